#!/usr/bin/python3
"""Speed and memory of trueline-convert's readers, beside independent readers of the same files.

    scripts/reader_speed.py --build=build --out=OUT --node=FOLDER --mb=100 FOLDER

FOLDER holds logs of any of the formats; of each format the largest file that can be made longer is
taken. Its records are repeated, with later times where the format's own records carry them, to --mb
and to a quarter of it. For each the table has MB for each second of processor time of `convert --in` (lists all channels) and of
`convert --in --out` (a native log; "-" where none can be made of the repeated file, as where times
inside of messages repeat), and the peak memory of both lengths. A reader whose memory does not grow
with the file has the same figure twice.

Independent readers decode every message. Those of npm are taken from --node, a folder where

    npm install --ignore-scripts @foxglove/ulog @mcap/core @mcap/support @foxglove/rosbag \\
        @foxglove/rosmsg @foxglove/rosmsg2-serialization

was run; sqlite3 and pandas are Python's. What is not installed is said so and skipped. Nothing in
the project needs them. The table goes to OUT/readers.md.
"""
import argparse
import os
import re
import shutil
import sqlite3
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCE / "scripts"))
import ekf_prediction

READ = {  # programs of the independent readers; argument: the file
    "@foxglove/ulog": """
const {ULog, MessageType} = require("@foxglove/ulog"), {FileReader} = require("@foxglove/ulog/node");
(async () => { const u = new ULog(new FileReader(process.argv[1])); await u.open(); let n = 0;
  for await (const m of u.readMessages()) if (m.type === MessageType.Data) ++n; console.log(n); })();
""",
    "@mcap/core, CDR": """
const {McapStreamReader} = require("@mcap/core"), {parse} = require("@foxglove/rosmsg");
const {MessageReader} = require("@foxglove/rosmsg2-serialization"), fs = require("fs");
const r = new McapStreamReader({validateCrcs: true}), buffer = Buffer.alloc(1 << 20);
const schemas = new Map(), channels = new Map(); let n = 0, size;
const file = fs.openSync(process.argv[1]);
while ((size = fs.readSync(file, buffer)) > 0) {
  r.append(new Uint8Array(buffer.subarray(0, size)));
  for (let e; (e = r.nextRecord());) {
    if (e.type === "Schema") schemas.set(e.id, new MessageReader(
        parse(new TextDecoder().decode(e.data), {ros2: true})));
    else if (e.type === "Channel") channels.set(e.id, schemas.get(e.schemaId));
    else if (e.type === "Message") { channels.get(e.channelId).readMessage(e.data); ++n; }
  }
}
console.log(n);
""",
    "@foxglove/rosbag": """
const {Bag} = require("@foxglove/rosbag"), {FileReader} = require("@foxglove/rosbag/node");
(async () => { const b = new Bag(new FileReader(process.argv[1])); await b.open(); let n = 0;
  for await (const m of b.messageIterator()) if (m.message) ++n; console.log(n); })();
""",
}
PYTHON = {
    "sqlite3 (rows, not decoded)": """
import glob, sqlite3, sys
rows = sqlite3.connect(glob.glob(sys.argv[1] + "/*.db3")[0]).execute("SELECT timestamp, data FROM messages")
print(sum(1 for _ in rows))
""",
    "pandas": """
import sys, pandas
print(len(pandas.read_csv(sys.argv[1], sep=sys.argv[2] if len(sys.argv) > 2 else ",", comment="#",
                          header=None if len(sys.argv) > 2 else 0)))
""",
}


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--node", type=Path, default=Path("node_modules"))
    parser.add_argument("--mb", type=float, default=100.0, help="size of the longer files")
    parser.add_argument("folder", type=Path)
    return parser.parse_args()


def ulog_records(data):
    at = 16
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<Hc", data, at)
        if size == 0 or at + 3 + size > len(data):
            return
        yield kind, data[at:at + 3 + size]
        at += 3 + size


def longer_ulog(data, size):
    """The data records again and again, each time later by the log's length."""
    formats, stamps, rows = {}, {}, []
    head = bytearray(data[:16])
    for kind, record in ulog_records(data):
        if kind == b"D":
            rows.append(bytearray(record))
            continue
        head += record
        if kind == b"F":
            name, fields = record[3:].decode(errors="replace").split(":", 1)
            formats[name] = fields
        elif kind == b"A":
            at, offsets = 5, []
            for name, code in ekf_prediction.ulog_fields(formats, record[6:].decode()):
                if name in ("timestamp", "timestamp_sample"):
                    offsets.append(at)
                at += struct.calcsize("<" + code)
            stamps[struct.unpack_from("<H", record, 4)[0]] = offsets
    topic = [struct.unpack_from("<H", row, 3)[0] for row in rows]
    times = [struct.unpack_from("<Q", row, stamps[t][0])[0] for row, t in zip(rows, topic)]
    span = max(times) - min(times) + 4000
    while True:
        yield bytes(head)
        head = bytearray()
        for row, number in zip(rows, topic):
            head += row
            for at in stamps[number]:
                value = struct.unpack_from("<Q", row, at)[0]
                struct.pack_into("<Q", row, at, value + span if value else 0)


def longer_mcap(data, size):
    """The messages of a file without chunks again and again, logged later."""
    at, head, rows = 8, bytearray(data[:8]), bytearray()
    while at + 9 <= len(data) - 8:
        kind, length = struct.unpack_from("<BQ", data, at)
        record = data[at:at + 9 + length]
        at += 9 + length
        if kind == 6:
            raise ValueError("has chunks")
        if kind == 15:
            break
        if kind == 5:
            rows += record
        else:
            head += record
    yield bytes(head)
    while True:
        yield bytes(rows)


def bag_fields(header):
    fields, at = {}, 0
    while at < len(header):
        size = struct.unpack_from("<I", header, at)[0]
        name, value = header[at + 4:at + 4 + size].split(b"=", 1)
        fields[name] = value
        at += 4 + size
    return fields


def bag_record(fields, data):
    header = b"".join(struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value
                      for name, value in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def bag_records(data, at):
    while at + 8 <= len(data):
        header = struct.unpack_from("<I", data, at)[0]
        body = struct.unpack_from("<I", data, at + 4 + header)[0]
        end = at + 8 + header + body
        yield bag_fields(data[at + 4:at + 4 + header]), data[end - body:end], at
        at = end


def longer_bag(data, size):
    """A bag's chunks again and again, with an index of all."""
    head, padding, _ = next(bag_records(data, 13))
    index_at = struct.unpack("<Q", head[b"index_pos"])[0]
    first = 13 + len(bag_record(head, padding))
    block = data[first:index_at]
    times = max(1, round(size / len(block)))
    connections, chunks = b"", []
    for fields, body, _ in bag_records(data, index_at):
        if fields[b"op"] == b"\x07":
            connections += bag_record(fields, body)
        else:
            chunks.append((fields, body))
    head[b"index_pos"] = struct.pack("<Q", first + times * len(block))
    head[b"chunk_count"] = struct.pack("<I", times * len(chunks))
    yield data[:13] + bag_record(head, padding)
    for _ in range(times):
        yield block
    yield connections
    for i in range(times):
        for fields, body in chunks:
            place = struct.unpack("<Q", fields[b"chunk_pos"])[0] + i * len(block)
            yield bag_record({**fields, b"chunk_pos": struct.pack("<Q", place)}, body)


def longer_dataflash(data, size):
    """The records again and again; each time their TimeUS is later."""
    at, sizes, timed, head, rows = 0, {}, set(), bytearray(), []
    while at + 3 <= len(data):
        kind = data[at + 2]
        length = 89 if kind == 128 else sizes.get(kind)
        if data[at:at + 2] != b"\xa3\x95" or length is None or at + length > len(data):
            at += 1
            continue
        record = bytearray(data[at:at + length])
        at += length
        if kind == 128:
            sizes[record[3]] = record[4]
            if record[25:].startswith(b"TimeUS") and record[9:10] == b"Q":
                timed.add(record[3])
        if kind in timed:
            rows.append(record)
        else:
            head += record
    times = [struct.unpack_from("<Q", row, 3)[0] for row in rows]
    span = max(times) - min(times) + 4000
    yield bytes(head)
    while True:
        yield b"".join(rows)
        for row in rows:
            struct.pack_into("<Q", row, 3, struct.unpack_from("<Q", row, 3)[0] + span)


def longer_crazyflie(data, size):
    """The events again and again, later each time; the CRC is right."""
    version, types = struct.unpack_from("<HH", data, 1)
    at, sizes = 5, {}
    for _ in range(types):
        number = struct.unpack_from("<H", data, at)[0]
        name = data.index(b"\0", at + 2) + 1
        count, at = struct.unpack_from("<H", data, name)[0], name + 2
        sizes[number] = 10
        for _ in range(count):
            end = data.index(b"\0", at)
            sizes[number] += struct.calcsize("<" + data[end - 2:end - 1].decode())
            at = end + 1
    if version != 2:
        raise ValueError("is of version 1")
    head, rows = data[:at], []
    while at + 10 <= len(data) - 4:
        length = sizes[struct.unpack_from("<H", data, at)[0]]
        rows.append(bytearray(data[at:at + length]))
        at += length
    times = [struct.unpack_from("<Q", row, 2)[0] for row in rows]
    span, check, made = max(times) - min(times) + 1000, zlib.crc32(head), len(head)
    yield head
    while made < size:
        block = b"".join(rows)
        check, made = zlib.crc32(block, check), made + len(block)
        yield block
        for row in rows:
            struct.pack_into("<Q", row, 2, struct.unpack_from("<Q", row, 2)[0] + span)
    yield struct.pack("<I", check)


def longer_blackbox(data, size):
    """The sessions of a file again and again, as a flash chip holds them."""
    while True:
        yield data


def longer_table(data, size, separator):
    """A table's rows again and again; the first column is a time that goes on."""
    lines = data.decode().splitlines(keepends=True)
    is_row = [line[:1].isdigit() or line[:1] in "-." for line in lines]
    rows = [line.split(separator, 1) for line, row in zip(lines, is_row) if row]
    times = [float(row[0]) for row in rows]
    span = times[-1] - times[0] + (times[1] - times[0])
    yield "".join(line for line, row in zip(lines, is_row) if not row).encode()
    shift = 0.0
    while True:
        yield "".join(f"{t + shift:.9f}{separator}{row[1]}" for t, row in zip(times, rows)).encode()
        shift += span


def write_until(path, pieces, size):
    with open(path, "wb") as file:
        for piece in pieces:
            file.write(piece)
            if file.tell() >= size and pieces.__name__ not in ("longer_bag", "longer_crazyflie"):
                break


def longer_sqlite(folder, out, size):
    """A ROS 2 bag whose messages come again and again, later."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for file in folder.iterdir():
        shutil.copyfile(file, out / file.name)
    file = next(out.glob("*.db3"))
    base = sqlite3.connect(file)
    first, last, count = base.execute(
        "SELECT min(timestamp), max(timestamp), max(id) FROM messages").fetchone()
    times = max(1, round(size / file.stat().st_size))
    for i in range(1, times):
        base.execute("INSERT INTO messages SELECT id + ?, topic_id, timestamp + ?, data FROM messages"
                     " WHERE id <= ?", (i * count, i * (last - first + 10_000_000), count))
    base.commit()
    base.close()


FORMATS = [  # name, files, how a longer one is made, independent reader
    ("PX4 ULog", "**/*.ulg", longer_ulog, "@foxglove/ulog"),
    ("ROS 1 bag", "**/*none.bag", longer_bag, "@foxglove/rosbag"),
    ("ROS 2 bag (sqlite3)", "**/nanobench*/metadata.yaml", longer_sqlite,
     "sqlite3 (rows, not decoded)"),
    ("MCAP (CDR, no chunks)", "**/*unchunked.mcap", longer_mcap, "@mcap/core, CDR"),
    ("ArduPilot DataFlash", "**/*.[bB][iI][nN]", longer_dataflash, ""),
    ("Betaflight blackbox", "**/bf*.b[bf]l", longer_blackbox, ""),
    ("Crazyflie micro-SD", "**/crazyflie/*log[0-9]*[0-9]", longer_crazyflie, ""),
    ("TUM trajectory", "**/tum_*.txt", lambda data, size: longer_table(data, size, " "), "pandas"),
]


def peak_memory(process):
    """MB so far; of the program alone (ru_maxrss counts this script's memory, too)."""
    try:
        text = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = re.search(r"VmHWM:\s+(\d+) kB", text)
    return int(found[1]) / 1024.0 if found else 0.0


def measured(command, environment=None):
    """Exit code, processor time in s, peak memory in MB."""
    child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL,
                             env={**os.environ, "OMP_NUM_THREADS": "1", **(environment or {})})
    memory, ended = 0.0, 0
    while not ended:
        memory = max(memory, peak_memory(child.pid))
        time.sleep(0.01)
        ended, status, usage = os.wait4(child.pid, os.WNOHANG)
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, memory


def independent(arguments, name, file):
    """MB/s and memory, or why there are none."""
    if not name:
        return "none by npm or pip", None
    if name in PYTHON:
        extra = [" "] if file.suffix == ".txt" else []
        command = [sys.executable, "-c", PYTHON[name], str(file), *extra]
        environment = None
    else:
        command = ["node", "-e", READ[name], str(file)]
        environment = {"NODE_PATH": str(arguments.node / "node_modules")}
    if not shutil.which(command[0]):
        return f"{name}: {command[0]} is not installed", None
    code, seconds, memory = measured(command, environment)
    if code != 0:
        return f"{name}: not installed", None
    return name, (size_of(file) / seconds, memory)


def size_of(path):
    """MB."""
    files = [path] if path.is_file() else path.glob("*.db3")
    return sum(file.stat().st_size for file in files) / 1e6


def make(source, maker, out, mb):
    if maker is longer_sqlite:
        longer_sqlite(source.parent, out, mb * 1e6)
        return out
    path = out.with_suffix(source.suffix)
    write_until(path, maker(source.read_bytes(), mb * 1e6), mb * 1e6)
    return path


def row(arguments, name, pattern, maker, other):
    sources = sorted(arguments.folder.glob(pattern), key=lambda file: file.stat().st_size)
    for source in reversed([file for file in sources if not re.search("corrupt|appended|cut|trunc",
                                                                      file.name)]):
        work = arguments.out / re.sub(r"\W+", "_", name)
        convert = str(arguments.build / "apps" / "trueline-convert")
        listed, made = [], None
        for mb in (0.25 * arguments.mb, arguments.mb):
            file = make(source, maker, work, mb)
            listed.append((size_of(file), *measured([convert, f"--in={file}"])))
        if listed[-1][1] not in (0, 3):
            continue
        code, seconds, memory = measured([convert, f"--in={file}", f"--out={work}_log", "--quiet"])
        made = f"{listed[-1][0] / seconds:.0f} ({memory:.0f} MB)" if code == 0 else "-"
        reader, speed = independent(arguments, other, file)
        theirs = f"{reader}: {speed[0]:.0f} ({speed[1]:.0f} MB)" if speed else reader
        shutil.rmtree(f"{work}_log", ignore_errors=True)
        shutil.rmtree(file) if file.is_dir() else file.unlink()
        sizes = " / ".join(f"{entry[0]:.0f}" for entry in listed)
        memories = " / ".join(f"{entry[3]:.0f}" for entry in listed)
        return (f"| {name} | {sizes} | {listed[-1][0] / listed[-1][2]:.0f} | {memories} | {made} "
                f"| {theirs} |")
    return f"| {name} | no file of it in the folder | | | | |"


def main():
    arguments = parse()
    arguments.node = arguments.node.resolve()
    arguments.out.mkdir(parents=True, exist_ok=True)
    lines = ["| format | file, MB | listed, MB/s | peak memory, MB | to a native log, MB/s (memory) "
             "| independent reader, MB/s (memory) |", "|---|---|---|---|---|---|"]
    for entry in FORMATS:
        lines.append(row(arguments, *entry))
        print(lines[-1], flush=True)
    (arguments.out / "readers.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
