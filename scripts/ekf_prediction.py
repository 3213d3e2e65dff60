#!/usr/bin/python3
"""Blind arcs of flights with an autopilot's filter: Trueline's prediction beside the filter's own.

    scripts/ekf_prediction.py --build=build --out=OUT FOLDER|LOG...

For every PX4 log (.ulg) and ArduPilot log (.bin) with GNSS or vision and a filter's estimate: the
log is converted, calibrated (arcs are made by withholding) and diagnosed. Over the same arcs the
filter's state at the arc's start is integrated without fixes: its position and velocity, the IMU less
the filter's biases, the filter's attitude. That attitude was corrected by fixes of the arc, which
favours the filter. Both count from the last fix before the arc, as `truth: fixes` does, and both end
where a fix that is late by --latency (EKF) or by the estimated delay (Trueline) shows the vehicle.
A third predictor holds the filter's velocity.

Wind: the mean of the log's own estimate (wind, wind_estimate, estimator_states, XKF2) beside the wind
that the diagnosis names. A line says why a log has no figures. OUT/table.md has the table.
"""
import argparse
import bisect
import csv
import math
import os
import struct
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import yaml

SOURCE = Path(__file__).resolve().parents[1]
GRAVITY = 9.80665  # m/s^2
CODES = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint16_t": "H", "int32_t": "i",
         "uint32_t": "I", "int64_t": "q", "uint64_t": "Q", "float": "f", "double": "d",
         "bool": "?", "char": "c"}


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--latency", type=float, default=0.11,
                        help="s, of the fixes, for the filter's arcs (EKF2_GPS_DELAY's default)")
    parser.add_argument("logs", type=Path, nargs="+")
    return parser.parse_args()


def ulog_fields(formats, name):
    """(name, code) of a ULog message, arrays and nested types spelled out."""
    fields = []
    for part in formats[name].strip(";").split(";"):
        kind, field = part.split()
        kind, _, count = kind.partition("[")
        names = [field] if not count else [f"{field}[{i}]" for i in range(int(count[:-1]))]
        for one in names:
            if kind in CODES:
                fields.append((one, CODES[kind]))
            else:
                fields += [(f"{one}.{inner}", code) for inner, code in ulog_fields(formats, kind)]
    return fields


def read_ulog(path):
    """Rows of every topic's first instance: {topic: [{field: value}]}, times in s as `t`."""
    data, at = path.read_bytes(), 16
    formats, topics, rows = {}, {}, {}
    while at + 3 <= len(data):
        size, kind = struct.unpack_from("<Hc", data, at)
        body, at = data[at + 3:at + 3 + size], at + 3 + size
        if len(body) < size or size == 0:
            break
        if kind == b"F":
            name, fields = body.decode(errors="replace").split(":", 1)
            formats[name] = fields
        elif kind == b"A" and body[0] == 0:
            fields = ulog_fields(formats, body[3:].decode())
            while fields[-1][0].startswith("_padding"):
                fields.pop()
            layout = struct.Struct("<" + "".join(code for _, code in fields))
            topics[struct.unpack_from("<H", body, 1)[0]] = (body[3:].decode(), fields, layout)
        elif kind == b"D":
            topic = topics.get(struct.unpack_from("<H", body)[0])
            if topic is None or len(body) - 2 < topic[2].size:
                continue
            values = topic[2].unpack_from(body, 2)
            row = dict(zip((field for field, _ in topic[1]), values))
            row["t"] = 1e-6 * (row.get("timestamp_sample") or row["timestamp"])
            rows.setdefault(topic[0], []).append(row)
    return rows


def read_dataflash(path):
    """The same of a DataFlash log; of several sensors (I, C) the first."""
    letters = dict(zip("bBhHiIqQfdMcCeELgnNZa", "b B h H i I q Q f d B h H i I i 2s 4s 16s 64s 64s"
                       .split()))
    scale = {letter: 0.01 for letter in "cCeE"} | {"L": 1e-7}
    data, at, formats, rows = path.read_bytes(), 0, {}, {}
    while at + 3 <= len(data):
        if data[at:at + 2] != b"\xa3\x95":
            at += 1
            continue
        kind = data[at + 2]
        if kind == 128 and at + 89 <= len(data):
            number, size, name, layout, columns = struct.unpack_from("<BB4s16s64s", data, at + 3)
            text = [part.rstrip(b"\0").decode(errors="replace") for part in (name, layout, columns)]
            formats[number] = (text[0], size, text[1], text[2].split(","))
            at += 89
            continue
        if kind not in formats or at + formats[kind][1] > len(data):
            at += 1
            continue
        name, size, layout, columns = formats[kind]
        values = struct.unpack_from("<" + "".join(letters[c] for c in layout), data, at + 3)
        row = {column: value * scale[c] if c in scale else value
               for column, value, c in zip(columns, values, layout)}
        at += size
        if "TimeUS" in row and row.get("I", 0) == 0 and row.get("C", 0) == 0:
            row["t"] = 1e-6 * row["TimeUS"]
            rows.setdefault(name, []).append(row)
    return rows


def from_euler(roll, pitch, yaw):
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
    return (cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)


def vector(row, *names):
    return [row[name] for name in names]


def numbered(name, count, first=0):
    return [f"{name}[{i}]" for i in range(first, first + count)]


def px4_filter(path):
    """The filter's streams by name: rows of (t, values)."""
    topics = read_ulog(path)

    def rows(topic, *names):
        return [(row["t"], vector(row, *names)) for row in topics.get(topic, [])
                if all(name in row and math.isfinite(row[name]) for name in names)]

    found = {"imu": rows("sensor_combined", *numbered("accelerometer_m_s2", 3)),
             "attitude": rows("vehicle_attitude", *numbered("q", 4)),
             "state": rows("vehicle_local_position", "x", "y", "z", "vx", "vy", "vz"),
             "bias": rows("estimator_sensor_bias", *numbered("accel_bias", 3)),
             "wind": []}
    for topic, names in (("wind", ("windspeed_north", "windspeed_east")),
                         ("wind_estimate", ("windspeed_north", "windspeed_east")),
                         ("estimator_states", ("states[22]", "states[23]"))):
        found["wind"] = found["wind"] or rows(topic, *names)
    return found


def ardupilot_filter(path):
    topics = read_dataflash(path)

    def rows(topic, *names):
        return [(row["t"], vector(row, *names)) for row in topics.get(topic, [])
                if all(name in row for name in names)]

    turn = math.pi / 180.0
    attitude = [(t, from_euler(*(turn * angle for angle in angles)))
                for t, angles in rows("ATT", "Roll", "Pitch", "Yaw")]
    first = "XKF" if "XKF1" in topics else "NKF"
    return {"imu": rows("IMU", "AccX", "AccY", "AccZ"), "attitude": attitude,
            "state": rows(first + "1", "PN", "PE", "PD", "VN", "VE", "VD"),
            "bias": rows(first + "2", "AX", "AY", "AZ"), "wind": rows(first + "2", "VWN", "VWE")}


def last_before(rows, t):
    at = bisect.bisect_right(rows, t, key=lambda row: row[0])
    return rows[at - 1] if at > 0 else None


def turned(q, v):
    """A vector from body to earth."""
    w, x, y, z = q
    u = (y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0])
    uu = (y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0])
    return [v[i] + 2.0 * (w * u[i] + uu[i]) for i in range(3)]


def displacements(streams, begin, end):
    """Horizontal (dead reckoning, velocity held) from `begin` to `end`, m; None without a state."""
    longest = 0.3  # s, from the state to the start
    state = last_before(streams["state"], begin)
    if state is None or begin - state[0] > longest or not streams["attitude"]:
        return None
    bias = last_before(streams["bias"], begin) or (0.0, [0.0, 0.0, 0.0])
    v, p, t = list(state[1][3:]), [0.0] * 3, state[0]
    p = [-x * (begin - t) for x in v]  # the state is a little older than the start
    imu = streams["imu"]
    for i in range(bisect.bisect_right(imu, t, key=lambda row: row[0]), len(imu)):
        until = min(imu[i][0], end)
        attitude = last_before(streams["attitude"], until)
        if attitude is None:
            return None
        force = turned(attitude[1], [imu[i][1][k] - bias[1][k] for k in range(3)])
        force[2] += GRAVITY
        dt = until - t
        p = [p[k] + dt * v[k] + 0.5 * dt * dt * force[k] for k in range(3)]
        v = [v[k] + dt * force[k] for k in range(3)]
        t = until
        if t >= end:
            break
    held = [state[1][3 + k] * (end - begin) for k in range(2)]
    return (p[:2], held) if t >= end else None


def numbers(path):
    with open(path, newline="") as file:
        return [{key.split(" ")[0]: value for key, value in row.items()}
                for row in csv.DictReader(file)]


def arc_errors(folder, streams, latency):
    """[(Trueline, filter, velocity held)] m, of the arcs that all three predict."""
    fixes = [(float(row["t"]), [float(row["x"]), float(row["y"])])
             for row in numbers(folder / "log" / "fixes.csv")]
    found = []
    for arc in numbers(folder / "calibration" / "arcs.csv"):
        if arc["truth"] != "fixes":
            continue
        begin, end = float(arc["t_start"]), float(arc["t_end"])
        moved = displacements(streams, begin - latency, end - latency)
        first, last = last_before(fixes, begin + 1e-6), last_before(fixes, end + 1e-6)
        if moved is None or first is None:
            continue
        shown = [last[1][k] - first[1][k] for k in range(2)]
        errors = [math.hypot(m[0] - shown[0], m[1] - shown[1]) for m in moved]
        found.append((float(arc["final_point_error"]), *errors))
    return found


def run(arguments, folder, verb, *flags):
    folder.mkdir(parents=True, exist_ok=True)
    command = [str(arguments.build / "apps" / f"trueline-{verb}"), *flags]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace", check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1"})
    (folder / f"{verb}.txt").write_text(done.stdout)
    if done.returncode not in (0, 2, 3):
        raise RuntimeError(f"{' '.join(command)} ended with {done.returncode}")
    lines = [line for line in done.stdout.splitlines() if "no usable" in line or "error" in line]
    # What follows the program, "no usable log" and the file.
    return done.returncode, lines[-1].split(": ", 3)[-1] if lines else ""


def mean(values):
    return sum(values) / len(values)


def wind_text(streams, begin, end):
    rows = [wind for t, wind in streams["wind"] if begin <= t <= end]
    rows = [wind for wind in rows if any(wind)]  # zeros: not estimated
    if not rows:
        return "none"
    return "{:.1f}, {:.1f} m/s".format(mean([w[0] for w in rows]), mean([w[1] for w in rows]))


def named_wind(folder):
    file = folder / "diagnosis" / "diagnosis.yaml"
    if not file.exists():
        return "no diagnosis"
    for cause in yaml.safe_load(file.read_text()).get("causes") or []:
        if cause.get("effect", cause.get("id")) == "wind":
            return str({name: p["value"] for name, p in cause["parameters"].items()})
    return "none named"


def row(arguments, log):
    folder = arguments.out / log.name
    code, why = run(arguments, folder, "convert", f"--in={log}", f"--out={folder}/log")
    if code != 0:
        return f"| {log.name} | | | | | {why} |"
    code, why = run(arguments, folder, "calibrate", f"--log={folder}/log", "--report=false",
                    f"--out={folder}/calibration", "--gamma_sweep=")
    result = folder / "calibration" / "calibration.yaml"
    if not result.exists():
        return f"| {log.name} | | | | | {why} |"
    calibration = yaml.safe_load(result.read_text())
    if calibration["verdict"] != "unusable":
        run(arguments, folder, "diagnose", f"--log={folder}/log", "--report=false",
            f"--out={folder}/diagnosis")
    streams = (px4_filter if log.suffix == ".ulg" else ardupilot_filter)(log)
    errors = arc_errors(folder, streams, arguments.latency)
    times = [float(arc[key]) for arc in numbers(folder / "calibration" / "arcs.csv")
             for key in ("t_start", "t_end")]
    wind = wind_text(streams, min(times), max(times)) if times else "none"
    if not errors:
        return f"| {log.name} | {calibration['verdict']} | 0 | | {wind} | no arc with a filter's state |"
    columns = " / ".join(f"{mean([error[i] for error in errors]):.2f}" for i in range(3))
    return (f"| {log.name} | {calibration['verdict']} | {len(errors)} | {columns} | {wind}; "
            f"{named_wind(folder)} | {'; '.join(calibration['reasons'])} |")


def logs_in(path):
    if path.is_file():
        return [path]
    return [file for file in sorted(path.rglob("*")) if file.suffix.lower() in (".ulg", ".bin")]


def main():
    arguments = parse()
    lines = ["| log | verdict | arcs | mean error, m: Trueline / filter / its velocity held "
             "| wind: log's own; diagnosed | why not more |", "|---|---|---|---|---|---|"]
    for path in arguments.logs:
        for log in logs_in(path):
            lines.append(row(arguments, log))
            print(lines[-1], flush=True)
    (arguments.out / "table.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
