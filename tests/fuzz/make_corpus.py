#!/usr/bin/python3
"""Writes a corpus of small made logs, a folder for each fuzz target: make_corpus.py FOLDER.

All bytes are made here, from the formats' specifications; a fuzz target mutates them.
"""
import json
import sqlite3
import sys
import zlib
from pathlib import Path
from struct import pack

SOURCE = Path(__file__).resolve().parents[2]
IMU_MSG = ("Header header\ngeometry_msgs/Vector3 angular_velocity\n"
           "geometry_msgs/Vector3 linear_acceleration\nfloat64[] more\n"
           "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
           "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n")
POINT_MSG = ("Header header\nPoint point\nfloat64[] more\n===\nMSG: std_msgs/Header\n"
             "builtin_interfaces/Time stamp\nstring frame_id\n"
             "===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n")


def text(value):
    return pack("<I", len(value)) + value


def ulog():
    def record(kind, payload):
        return pack("<H", len(payload)) + kind + payload
    definitions = b"".join(record(b"F", f) for f in (
        b"topic:uint64_t timestamp;uint64_t timestamp_sample;float x;inner[2] a;uint8_t[4] _padding0;",
        b"inner:int16_t v;uint8_t[2] _padding0;"))
    data = b"".join(
        record(b"D", pack("<HQQfh2xh2x", 3, t * 10000, t * 10000 - 50, 0.5 * t, -7, 8))
        for t in range(1, 9))
    yield (b"ULog\x01\x12\x35\x01" + bytes(8) + record(b"B", bytes(40)) + definitions +
           record(b"I", b"\x0dchar[4] sys_aabcd") + record(b"A", b"\0" + pack("<H", 3) + b"topic") +
           data + record(b"S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12") +
           record(b"O", pack("<H", 20)) + record(b"L", b"6" + bytes(8) + b"hello") + data)


def ros1_imu(t):
    return pack("<III", t, t, 5000) + text(b"imu") + pack("<6d", *range(6)) + pack("<I", 1) + pack(
        "<d", 1.0)


def rosbag1():
    def fields(**values):
        return b"".join(text(name.encode() + b"=" + value) for name, value in values.items())

    def record(data, **header):
        return text(fields(**header)) + text(data)
    link = dict(op=b"\x07", conn=pack("<I", 0), topic=b"/imu")
    connection = record(fields(topic=b"/imu", type=b"sensor_msgs/Imu", md5sum=b"*",
                               message_definition=IMU_MSG.encode()), **link)
    messages = b"".join(record(ros1_imu(t), op=b"\x02", conn=pack("<I", 0), time=pack("<II", t, 0))
                        for t in range(1, 5))
    head = b"#ROSBAG V2.0\n" + record(b" " * 64, op=b"\x03", index_pos=pack("<Q", 0),
                                      conn_count=pack("<I", 1), chunk_count=pack("<I", 1))
    chunk = record(connection + messages, op=b"\x05", compression=b"none",
                   size=pack("<I", len(connection + messages)))
    yield head + chunk
    yield head + connection + messages


def cdr_point():
    return (b"\0\1\0\0" + pack("<iI", 5, 7) + text(b"imu\0") + pack("<3d", *range(3)) +
            pack("<I4xd", 1, 1.0))


def rosbag2():
    path = Path(sys.argv[1]) / "bag.db3"
    path.unlink(missing_ok=True)
    with sqlite3.connect(path) as base:
        base.execute("pragma page_size=512")
        base.execute("create table topics(id integer primary key, name text, type text, "
                     "serialization_format text, offered_qos_profiles text)")
        base.execute("create table messages(id integer primary key, topic_id integer, "
                     "timestamp integer, data blob)")
        base.execute("insert into topics values(1, '/imu', 'geometry_msgs/msg/PointStamped', 'cdr', '')")
        base.executemany("insert into messages values(?, 1, ?, ?)",
                         [(t, t * 10**7, bytes(cdr_point())) for t in range(1, 4)])
    yield path.read_bytes()
    path.unlink()


def mcap():
    def record(op, payload):
        return bytes([op]) + pack("<Q", len(payload)) + payload

    def schema(number, name, encoding, data):
        return record(3, pack("<H", number) + text(name) + text(encoding) + text(data))

    def channel(number, schema_number, topic, encoding):
        return record(4, pack("<HH", number, schema_number) + text(topic) + text(encoding) + text(b""))

    def message(number, t, data):
        return record(5, pack("<HIQQ", number, t, t * 10**7, t * 10**7) + data)
    row = json.dumps({"t": 1.5, "a": [1, 2, {"b": -3}], "s": "x"}).encode()
    # A FileDescriptorSet: message M {double x = 1; repeated int32 n = 2;} in package p.
    field_x = b"\x0a\x01x\x18\x01\x20\x01\x28\x01"
    field_n = b"\x0a\x01n\x18\x02\x20\x03\x28\x05"
    body = (b"\x0a\x01M" + b"\x12" + bytes([len(field_x)]) + field_x + b"\x12" +
            bytes([len(field_n)]) + field_n)
    file = b"\x0a\x02f.p\x12\x01p"[:4] + b"\x12\x01p" + b"\x22" + bytes([len(body)]) + body
    proto = b"\x0a" + bytes([len(file)]) + file
    content = (
        schema(1, b"geometry_msgs/msg/PointStamped", b"ros2msg", POINT_MSG.encode()) +
        schema(2, b"p.M", b"protobuf", proto) + channel(0, 1, b"/imu", b"cdr") +
        channel(1, 0, b"/json", b"json") + channel(2, 2, b"/proto", b"protobuf") +
        channel(3, 1, b"/old", b"ros1") + message(0, 1, cdr_point()) + message(1, 2, row) +
        message(2, 3, b"\x09" + pack("<d", 2.5) + b"\x12\x02\x01\x7f") + message(1, 4, row))
    start, end = b"\x89MCAP0\r\n", record(0x0F, bytes(4)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"
    yield start + record(1, text(b"") + text(b"")) + content + end
    yield start + record(6, pack("<QQQI", 0, 9, len(content), zlib.crc32(content)) + text(b"") +
                         pack("<Q", len(content)) + content) + end


def dataflash():
    def define(kind, length, name, letters, columns):
        return b"\xA3\x95\x80" + pack("<BB4s16s64s", kind, length, name, letters, columns)
    samples = b"".join(b"\xA3\x95\x05" + pack("<QBhf", t * 10000, t % 2, 250, 4.0)
                       for t in range(1, 9))
    yield (define(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns") +
           define(5, 18, b"SENS", b"QBcf", b"TimeUS,I,Lean,X") +
           define(6, 20, b"MULT", b"Qbd", b"TimeUS,Id,Mult") +
           define(7, 76, b"UNIT", b"QbZ", b"TimeUS,Id,Label") +
           define(8, 44, b"FMTU", b"QBNN", b"TimeUS,FmtType,UnitIds,MultIds") +
           b"\xA3\x95\x06" + pack("<Qbd", 0, 67, 1e-3) +
           b"\xA3\x95\x07" + pack("<Qb64s", 0, 109, b"m") +
           b"\xA3\x95\x08" + pack("<QB16s16s", 0, 5, b"s#-m", b"F--C") + samples)


def blackbox():
    names = "loopIteration,time,gyroADC[0],accSmooth[0],motor[0],vbatLatest"
    lines = ["Product:Blackbox flight data recorder by Nicholas Sherlock", "Data version:2",
             "I interval:4", "P interval:1/1", f"Field I name:{names}",
             "Field I signed:0,0,1,1,0,0", "Field I predictor:0,0,0,0,4,9",
             "Field I encoding:1,1,0,0,1,3", "Field P predictor:6,2,3,3,3,1",
             "Field P encoding:9,0,8,7,6,10", "Field S name:flightModeFlags,state",
             "Field S signed:0,0", "Field S predictor:0,0", "Field S encoding:1,7",
             "Field G name:time,GPS_coord[0]", "Field G signed:0,1", "Field G predictor:10,7",
             "Field G encoding:1,0", "Field H name:GPS_home[0],GPS_home[1]", "Field H signed:1,1",
             "Field H predictor:0,0", "Field H encoding:0,0", "gyro_scale:0x3f800000",
             "minthrottle:1070", "vbatref:400", "acc_1G:2048"]
    frames = b"I\x00\x90\x4e\x05\x06\x10\x01" + b"P\x02\x11\x00\x00\x00\x00" * 3
    yield ("".join(f"H {line}\n" for line in lines).encode() + frames + b"S\x01\x00" +
           b"H\x02\x04G\x05\x06" + frames + b"E\xffEnd of log\0")


def crazyflie():
    head = (b"\xBC" + pack("<HH", 2, 1) + pack("<H", 0) + b"fixedFrequency\0" + pack("<H", 3) +
            b"acc.x(f)\0gyro.x(h)\0stateEstimate.x(d)\0")
    body = b"".join(pack("<HQfhd", 0, t * 10000, 1.0, 3, 2.0) for t in range(1, 9))
    yield head + body + pack("<I", zlib.crc32(head + body))


def tum():
    yield b"# t tx ty tz qx qy qz qw\n" + b"".join(
        f"{t * 0.01:.3f} {t} 0 1e-3 0 0 0 1\n".encode() for t in range(1, 9))


def csv():
    yield b"t,ax [m/s^2],name,q\n" + b"".join(f"{t},{t * .5},x,\n".encode() for t in range(1, 9))
    yield b'time;"a b";c\r\n1;2,5;3\r\n2;-1e-3;nan\r\n'


def native_log():
    streams = [b"name: x\nframe: NED\nbody: FRD\ngravity: 9.81\n"
               b"gates:\n  - {id: 0, position: [1, 2, 3], yaw: 0}\n",
               b"t [s],ax [m/s^2],ay,az,gx [rad/s],gy,gz\n0,0,0,-9.81,0,0,0\n0.01,1,2,3,4,5,6\n",
               b"t [s],qw [1],qx,qy,qz\n0,1,0,0,0\n0.01,1,0,0,0\n",
               b"t [s],x [m],y,z,sigma [m],gate [1]\n0.5,1,2,3,0.1,0\n",
               b"t [s],x [m],y,z,qw [1],qx,qy,qz\n0,1,2,3,1,0,0,0\n",
               b"t [ms],x [cm],y,z,qw [1],qx,qy,qz\n0,1,2,3,1,0,0,0\n",
               b"t [s],w1 [rpm],w2\n0,1,2\n", b"t [s],u1 [1],u2\n0,0,1\n",
               b"t [s],voltage [V]\n0,12\n", b"t [s],range [mm]\n0,1\n"]
    for number, content in enumerate(streams):
        yield bytes([number]) + content


def yaml():
    for folder in ("import", "simulate"):
        for file in sorted((SOURCE / "config" / folder).glob("*.yaml")):
            yield file.read_bytes()


def program_code():
    for name in ("airsim.hpp", "isaac_lab.py"):
        yield (SOURCE / "config/export" / name).read_bytes()


def main():
    for make in (ulog, rosbag1, rosbag2, mcap, dataflash, blackbox, crazyflie, tum, csv,
                 native_log, yaml, program_code):
        folder = Path(sys.argv[1]) / make.__name__
        folder.mkdir(parents=True, exist_ok=True)
        for number, content in enumerate(make()):
            (folder / f"made{number}").write_bytes(content)


if __name__ == "__main__":
    main()
