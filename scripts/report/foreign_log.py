"""A native log as an autopilot or a laboratory would have logged the flight: ulog (PX4), dataflash (ArduPilot),
blackbox (Betaflight), crazyflie (micro-SD card), tum (the path of a motion capture system) or csv (one table with
Vicon's pose). Only what such a log usually holds is written, in the units and axes of that format.
"""
import math
import zlib
from struct import pack

import numpy as np
import pandas as pd

from csv_table import read_table
from page import Document

G = 9.80665  # m/s^2
FLIP = np.array([1.0, -1.0, -1.0])  # forward-right-down to forward-left-up, and north-east-down to north-west-up
HOME = (47.0, 8.0, 400.0)  # of position 0 0 0: latitude and longitude in deg, height in m
ACCEL, GYRO, PLACE, QUATERNION = (["ax", "ay", "az"], ["gx", "gy", "gz"], ["x", "y", "z"], ["qw", "qx", "qy", "qz"])
COLUMNS = {"imu": ["t", *ACCEL, *GYRO], "attitude": ["t", *QUATERNION], "fixes": ["t", *PLACE, "sigma"],
           "mocap": ["t", *PLACE, *QUATERNION]}


class Log:
    """The streams of a native log as tables without units in their headers."""

    def __init__(self, folder):
        self.folder = folder

    def __getattr__(self, name):
        return read_table(self.folder / f"{name}.csv", COLUMNS[name], remedy="the format needs this stream of the log")

    def held(self, name):
        """A stream's last row at each IMU sample."""
        return pd.merge_asof(self.imu[["t"]], getattr(self, name), on="t")


def microseconds(frame):
    return np.round(1e6 * frame.t.to_numpy()).astype(np.uint64)


def geodetic(fixes):
    """Latitude and longitude in deg and height in m on the WGS 84 ellipsoid, for a course of some hundred metres."""
    latitude, longitude, height = HOME
    a, e2 = 6378137.0, 6.69437999014e-3
    root = math.sqrt(1.0 - e2 * math.sin(math.radians(latitude))**2)
    north, east = a * (1.0 - e2) / root**3 + height, (a / root + height) * math.cos(math.radians(latitude))
    return latitude + np.degrees(fixes.x / north), longitude + np.degrees(fixes.y / east), height - fixes.z


def euler_deg(frame):
    w, x, y, z = frame[QUATERNION].to_numpy().T
    return np.degrees([np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
                       np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
                       np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))])


def packed(head, kinds, columns):
    """A row of bytes for each sample: `head`, then the columns as the NumPy kinds say."""
    columns = [np.asarray(column) for column in columns]
    rows = np.empty(len(columns[0]), [("head", f"V{len(head)}")] + [(str(i), kind) for i, kind in enumerate(kinds)])
    rows["head"] = np.void(head)
    for i, column in enumerate(columns):
        rows[str(i)] = np.round(column) if rows.dtype[str(i)].kind in "iu" else column
    return [row.tobytes() for row in rows]


def in_time(streams):
    """The records of [(stamps, records), ...] in the order of time."""
    stamps = np.concatenate([times for times, _ in streams])
    records = [record for _, rows in streams for record in rows]
    return b"".join(records[i] for i in np.argsort(stamps, kind="stable"))


def ulog(log):
    """https://docs.px4.io/main/en/dev_log/ulog_file_format.html"""
    def record(kind, payload):
        return pack("<H", len(payload)) + kind + payload
    latitude, longitude, height = geodetic(log.fixes)
    topics = [("sensor_combined", "float[3] gyro_rad;float[3] accelerometer_m_s2;", log.imu, ["<f4"] * 6,
               log.imu[GYRO + ACCEL].to_numpy().T),
              ("vehicle_attitude", "float[4] q;", log.attitude, ["<f4"] * 4, log.attitude[QUATERNION].to_numpy().T),
              ("sensor_gps", "double latitude_deg;double longitude_deg;double altitude_msl_m;float eph;uint8_t fix_type;",
               log.fixes, ["<f8"] * 3 + ["<f4", "u1"],
               [latitude, longitude, height, log.fixes.sigma, np.full(len(height), 3)])]
    formats, subscriptions, streams = b"", b"", []
    for number, (name, fields, frame, kinds, columns) in enumerate(topics):
        formats += record(b"F", f"{name}:uint64_t timestamp;{fields}".encode())
        subscriptions += record(b"A", pack("<BH", 0, number) + name.encode())
        size = 2 + 8 + sum(np.dtype(kind).itemsize for kind in kinds)
        stamps = microseconds(frame)
        streams.append((stamps, packed(pack("<HcH", size, b"D", number), ["<u8", *kinds], [stamps, *columns])))
    return b"ULog\x01\x12\x35\x01" + bytes(8) + record(b"B", bytes(40)) + formats + subscriptions + in_time(streams)


def dataflash(log):
    """https://ardupilot.org/dev/docs/code-overview-adding-a-new-log-message.html"""
    def define(number, length, name, letters, columns):
        return b"\xA3\x95\x80" + pack("<BB4s16s64s", number, length, name.encode(), letters.encode(), columns.encode())
    latitude, longitude, height = geodetic(log.fixes)
    messages = [("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", log.imu, ["u1"] + ["<f4"] * 6,
                 [np.zeros(len(log.imu)), *log.imu[GYRO + ACCEL].to_numpy().T]),
                ("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", log.attitude, ["<f4"] * 3, euler_deg(log.attitude)),
                ("GPS", "QBBLLf", "TimeUS,I,Status,Lat,Lng,Alt", log.fixes, ["u1", "u1", "<i4", "<i4", "<f4"],
                 [np.zeros(len(height)), np.full(len(height), 3), 1e7 * latitude, 1e7 * longitude, height])]
    head, streams = define(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"), []
    for number, (name, letters, columns, frame, kinds, values) in enumerate(messages, 1):
        length = 3 + 8 + sum(np.dtype(kind).itemsize for kind in kinds)
        head += define(number, length, name, letters, columns)
        stamps = microseconds(frame)
        streams.append((stamps, packed(b"\xA3\x95" + bytes([number]), ["<u8", *kinds], [stamps, *values])))
    return head + in_time(streams)


def variable_bytes(values, signed):
    """Blackbox's variable byte encoding of a row; signed numbers are zig-zag encoded first."""
    out = bytearray()
    for value, is_signed in zip(values, signed):
        value = (value << 1) ^ (value >> 31) if is_signed else value
        while value > 127:
            out.append(value & 127 | 128)
            value >>= 7
        out.append(value)
    return bytes(out)


def blackbox(log):
    """https://betaflight.com/docs/development/Blackbox-Internals: every frame is whole (an I frame), no GNSS"""
    def axes(name):
        return ",".join(f"{name}[{i}]" for i in range(3))
    names, signed = f"loopIteration,time,{axes('gyroADC')},{axes('accSmooth')}", [0, 0] + [1] * 6
    columns = [np.arange(len(log.imu)), microseconds(log.imu), *(10 * np.degrees(log.imu[GYRO] * FLIP)).to_numpy().T,
               *(2048 / G * log.imu[ACCEL] * FLIP).to_numpy().T]
    lines = ["Product:Blackbox flight data recorder by Nicholas Sherlock", "Data version:2", "I interval:1",
             "P interval:1/1", "Firmware revision:Betaflight 4.5.1", "gyro_scale:0x3f800000", "acc_1G:2048",
             "blackbox_high_resolution:1", f"Field I name:{names}", f"Field I signed:{','.join(map(str, signed))}"]
    lines += [f"Field {frame} {key}:{','.join(values)}" for frame in "IP" for key, values in (
        ("predictor", "0" * len(signed)), ("encoding", ["0" if s else "1" for s in signed]))]
    rows = np.stack([np.round(np.asarray(column)).astype(np.int64) for column in columns], axis=1).tolist()
    return ("".join(f"H {line}\n" for line in lines).encode() +
            b"".join(b"I" + variable_bytes(row, signed) for row in rows) + b"E\xffEnd of log\0")


def crazyflie(log):
    """https://www.bitcraze.io/documentation/repository/crazyflie-firmware/master/userguides/deck/micro-sd"""
    attitude, place = log.held("attitude"), log.held("mocap")
    columns = {**{f"acc.{n[1]}": log.imu[n] * f / G for n, f in zip(ACCEL, FLIP)},
               **{f"gyro.{n[1]}": np.degrees(log.imu[n] * f) for n, f in zip(GYRO, FLIP)},
               **{f"stateEstimate.{n}": place[n] * f for n, f in zip(PLACE, FLIP)},
               **{f"stateEstimate.{n}": attitude[n] * f for n, f in zip(QUATERNION, [1.0, *FLIP])}}
    head = (b"\xBC" + pack("<HHH", 2, 1, 0) + b"fixedFrequency\0" + pack("<H", len(columns)) +
            b"".join(name.encode() + b"(f)\0" for name in columns))
    known = ~np.isnan(np.stack(list(columns.values()))).any(axis=0)  # an estimate is there from the start
    rows = packed(pack("<H", 0), ["<u8"] + ["<f4"] * len(columns),
                  [column[known] for column in (microseconds(log.imu), *columns.values())])
    body = head + b"".join(rows)
    return body + pack("<I", zlib.crc32(body))


def tum(log):
    """A line a pose: t x y z qx qy qz qw, north-west-up and forward-left-up."""
    table = log.mocap[["t", *PLACE, *QUATERNION[1:], "qw"]] * [1.0, *FLIP, *FLIP, 1.0]
    return table.to_csv(index=False, header=False, sep=" ", float_format="%.9g").encode()


def csv(log):
    """A row for each IMU sample, forward-left-up and north-west-up; Vicon is slower: its values are held."""
    table = pd.DataFrame({"t_ms": 1e3 * log.imu.t})
    table[ACCEL] = log.imu[ACCEL] * FLIP / G
    table[GYRO] = np.degrees(log.imu[GYRO] * FLIP)
    flip = np.array([1.0, *FLIP])
    table[QUATERNION] = log.held("attitude")[QUATERNION] * flip
    mocap = log.held("mocap")
    table[["vicon_x", "vicon_y", "vicon_z"]] = 1e3 * mocap[PLACE] * FLIP
    table[["vicon_qw", "vicon_qx", "vicon_qy", "vicon_qz"]] = mocap[QUATERNION] * flip
    return table.to_csv(index=False, float_format="%.7g").encode()


FORMATS = {write.__name__: write for write in (ulog, dataflash, blackbox, crazyflie, tum, csv)}


def add_arguments(parser):
    parser.add_argument("--format", required=True, choices=FORMATS)


def build(arguments):
    return ForeignLog(arguments)


class ForeignLog(Document):
    def __init__(self, arguments):
        self.arguments = arguments

    def render(self):
        return FORMATS[self.arguments.format](Log(self.arguments.result))
