#!/usr/bin/python3
"""Writes one simulated flight as many kinds of table and looks whether each is read right or refused.

    scripts/knocks/variants.py --build=build --work=OUT [--count=200] [--seed=1]

A variant draws a flight (fast or gentle), a rate (20 Hz to 4 kHz), the unit, zero, width and form of the
clock, names, units and order of columns, axes, the form of the attitude (quaternions in any order, of
either sign or inverse, angles, rotation matrix) and of the place (m, mm, velocities, latitude and
longitude), one table or several, dense, sparse or held, what stands before the rows, other columns
beside, the packing, and at most one trouble of TROUBLES. It is converted without a map and inspected.
Against the flight are judged: the IMU's rows and span, the sizes of specific force, turn rate and path,
gravity in the attitude's earth, and the turns of the body by the attitude. Outcomes: right; refused (exit
code 2 or 3, with a remedy); said (something is wrong and a warning or finding tells of it); SILENT. Table
and commands of all silent ones go to OUT/variants.md; exit code 1 if there are any.
"""
import bz2
import gzip
import io
import lzma
import random
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections import Counter
from datetime import datetime, timezone
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE.parent / "blind/measured"), str(HERE.parent / "freeze")]

import numpy as np
import yaml

from native import QUATERNION, Log, continuous, inverse, product, resampled, turn
from program import SOURCE, app, flags
from program import parse as parse_flags

ACCEL, GYRO, PLACE = ("ax", "ay", "az"), ("gx", "gy", "gz"), ("x", "y", "z")
RATES = (20, 50, 64, 100, 128, 250, 500, 1000, 2000, 4000)
CLOCKS = {  # name, unit in s, decimals
    "s": (("t", "time", "Time (s)", "timestamp", "elapsed_s", "time_s"), 1.0, 6),
    "ms": (("t_ms", "time_ms", "Time [ms]", "timestamp"), 1e-3, 3),
    "us": (("timestamp", "time_us", "t [us]", "TimeUS"), 1e-6, 0),
    "ns": (("timestamp_ns", "#timestamp [ns]", "stamp_ns", "timestamp"), 1e-9, 0)}
NAMES = {  # accelerometer, gyroscope, position; {} stands for the axis
    "short": ("a{}", "g{}", "{}"), "words": ("acc_{}", "gyro_{}", "pos_{}"),
    "caps": ("Acc{}", "Gyro{}", "Pos{}"), "ros": ("linear_acceleration.{}", "angular_velocity.{}", "position.{}"),
    "units": ("acc_{} [{a}]", "gyro_{} [{g}]", "p_{} [m]"), "crazy": ("acc.{}", "gyro.{}", "stateEstimate.{}"),
    "index": ("accelerometer[{i}]", "gyroscope[{i}]", "position[{i}]"),
    "matlab": ("acc_b_{}", "ang_vel_{}", "pos_{}"), "imu": ("imu_a{}", "imu_g{}", "mocap_pos_{}")}
TROUBLES = ("none", "none", "none", "wrap_us", "wrap_ms", "wrap_16", "shared", "zeros", "held", "restart")
ATTITUDES = ("wxyz", "wxyz", "xyzw", "rad", "deg", "matrix", "0123", "1230", "inverse", "flips")
FLIGHTS = ("fast", "fast", "figure_eight")
HEADS = ("", "", "", "units", "comments", "bom", "quoted", "number", "crlf", "blank")
BESIDE = {  # columns that are no measurement, or of another sensor
    "setpoints": ("roll_sp", "pitch_sp", "yaw_sp", "x_ref", "y_ref", "z_ref"),
    "magnetometer": ("mag_x", "mag_y", "mag_z", "baro_alt"), "motors": ("m1", "m2", "m3", "m4", "vbat"),
    "biases": ("gyro_bias_x", "gyro_bias_y", "gyro_bias_z", "accel_bias_x", "accel_bias_y", "accel_bias_z"),
    "state": ("armed", "mode", "loop", "cpu_load")}
HOME = (47.3977, 8.5456, 488.0)  # deg, deg, m


def zipped(data):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("table.csv", data)
    return target.getvalue()


def tarred(data):
    target = io.BytesIO()
    with tarfile.open(fileobj=target, mode="w:gz") as archive:
        entry = tarfile.TarInfo("table.csv")
        entry.size = len(data)
        archive.addfile(entry, io.BytesIO(data))
    return target.getvalue()


PACKED = {"": lambda data: data, ".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress,
          ".zip": zipped, ".tar.gz": tarred}


def parse():
    parser = flags(__doc__, count=200, seed=1)
    parser.add_argument("--only", type=int, help="this variant alone, kept to look at")
    return parse_flags(parser)


def flight(arguments, name):
    folder = arguments.work / f"flight_{name}"
    if not (folder / "log.yaml").exists():
        config = SOURCE / f"config/simulate/{name}.yaml"
        subprocess.run([app(arguments, "simulate"), f"--config={config}", "--seed=5",
                        "--duration=24", f"--out={folder}", "--quiet"], check=True)
    return Log(folder)


def draw(rng):
    return {"rate": rng.choice(RATES), "clock": rng.choice(sorted(CLOCKS)), "zero": rng.choice((0.0, 431.2, 1.7e9)),
            "names": rng.choice(sorted(NAMES)), "accel": rng.choice(("m/s^2", "m/s^2", "g")),
            "gyro": rng.choice(("rad/s", "rad/s", "deg/s")), "up": rng.random() < 0.5,
            "attitude": rng.choice(ATTITUDES),
            "layout": rng.choice(("held", "held", "sparse", "files")), "delimiter": rng.choice((",", ",", ";", "\t")),
            "shuffle": rng.random() < 0.4, "packed": rng.choice(("", "", *PACKED)), "trouble": rng.choice(TROUBLES),
            "flight": rng.choice(FLIGHTS), "place": rng.choice(("m", "m", "m", "mm", "velocity", "geodetic")),
            "stamp": rng.choice(("number", "number", "number", "date", "parts")), "head": rng.choice(HEADS),
            "comma": rng.random() < 0.3, "missing": rng.choice(("", "", "nan", "NaN")),
            "beside": rng.choice((None, None, *BESIDE))}


def upright(q, up):
    """The attitude in FLU and north-west-up where `up`."""
    flip = np.broadcast_to([0.0, 1, 0, 0], q.shape)
    return product(product(flip, q), flip * [1, -1, -1, -1]) if up else q


def attitude_columns(q, form):
    q = continuous(inverse(q) if form == "inverse" else q)
    if form == "flips":
        q = q * np.where(np.arange(len(q)) // 7 % 3 == 0, -1.0, 1.0)[:, None]
    w, x, y, z = q.T
    if form in ("0123", "1230"):
        return {f"q[{i}]": part for i, part in enumerate((w, x, y, z) if form == "0123" else (x, y, z, w))}
    if form in ("wxyz", "inverse", "flips"):
        return {"qw": w, "qx": x, "qy": y, "qz": z}
    if form == "xyzw":
        return {"qx": x, "qy": y, "qz": z, "qw": w}
    columns = [turn(q, np.tile(axis, (len(q), 1))) for axis in np.eye(3)]
    if form == "matrix":
        return {f"r{i + 1}{j + 1}": columns[j][:, i] for i in range(3) for j in range(3)}
    scale = np.degrees(1) if form == "deg" else 1.0
    angles = {"roll": np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
              "pitch": np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
              "yaw": np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))}
    return {name: scale * angle for name, angle in angles.items()}


def named(pattern, v):
    return {pattern.format(axis, i=i, a=v["accel"], g=v["gyro"]): i for i, axis in enumerate("xyz")}


def stamps_of(log, v):
    """ns, of the IMU; of high rates fewer seconds, so that no table has more than 24,000 rows."""
    last = min(log.imu.t[-1], log.imu.t[0] + round(24e12 / v["rate"]))
    return np.arange(log.imu.t[0], last, round(1e9 / v["rate"]))


def streams_of(log, v):
    """Stamps in s since the start, and columns: of the IMU with its attitude, and of positions."""
    t = stamps_of(log, v)
    signs = np.array([1.0, -1, -1]) if v["up"] else np.ones(3)
    force = resampled(log.imu, ACCEL, t) * signs / (9.80665 if v["accel"] == "g" else 1.0)
    rates = resampled(log.imu, GYRO, t) * signs * (np.degrees(1) if v["gyro"] == "deg/s" else 1.0)
    accel, gyro, place = NAMES[v["names"]]
    imu = {name: force[:, i] for name, i in named(accel, v).items()}
    imu |= {name: rates[:, i] for name, i in named(gyro, v).items()}
    imu |= attitude_columns(upright(resampled(log.attitude, QUATERNION, t), v["up"]), v["attitude"])
    at = np.arange(log.mocap.t[0], t[-1], round(1e9 / min(50, v["rate"])))
    places = resampled(log.mocap, PLACE, at) * signs
    seconds = (at - log.imu.t[0]) * 1e-9
    for start in np.array((0.25, 0.5, 0.75)) * seconds[-1]:
        rows = np.flatnonzero((seconds > start) & (seconds < start + 0.8))
        if v["trouble"] == "zeros":
            places[rows] = 0.0
        if v["trouble"] == "held":
            places[rows] = places[rows[0]]
    path = place_columns(seconds, places, place, v)
    if v["beside"]:
        rows = np.arange(len(t))
        imu |= {name: np.round(np.sin(0.3 * i + 2e-3 * i * rows), 2) for i, name in enumerate(BESIDE[v["beside"]], 1)}
    return [((t - log.imu.t[0]) * 1e-9, imu), (seconds, path)]


def place_columns(seconds, places, pattern, v):
    if v["place"] == "velocity":
        speeds = np.gradient(places, seconds, axis=0)
        return {f"v{axis}": speeds[:, i] for i, axis in enumerate("xyz")}
    if v["place"] == "geodetic":
        north, east, down = (places * ([1.0, -1, -1] if v["up"] else 1.0)).T
        return {"lat": HOME[0] + np.degrees(north / 6.37e6), "alt": HOME[2] - down,
                "lon": HOME[1] + np.degrees(east / (6.38e6 * np.cos(np.radians(HOME[0]))))}
    scale = 1e3 if v["place"] == "mm" else 1.0
    return {name.replace("[m]", f"[{v['place']}]"): scale * places[:, i] for name, i in named(pattern, v).items()}


def clock(seconds, v):
    """Names of the clock's columns, and each row's stamp as a text for each."""
    name, texts = numbers_of_clock(seconds, v)
    if v["trouble"].startswith("wrap") or v["trouble"] == "restart" or v["stamp"] == "number":
        return [name], [[text] for text in texts]
    if v["trouble"] == "shared":
        seconds = np.ceil(seconds * v["rate"] / 2 + 1e-9) * 2 / v["rate"]
    parts = [divmod(round((1.7e9 + s) * 1e9), 10**9) for s in seconds]
    if v["stamp"] == "parts":
        return ["header.stamp.sec", "header.stamp.nanosec"], [[str(a), str(b)] for a, b in parts]
    day = "%Y-%m-%d %H:%M:%S"
    return ["datetime"], [[f"{datetime.fromtimestamp(a, timezone.utc):{day}}.{b // 1000:06d}"] for a, b in parts]


def numbers_of_clock(seconds, v):
    names, unit, decimals = CLOCKS[v["clock"]]
    trouble, zero = v["trouble"], v["zero"]
    bits = {"wrap_us": (32, 1e-6), "wrap_ms": (32, 1e-3), "wrap_16": (16, 1e-3)}.get(trouble)
    if bits:
        count, unit = bits
        whole = np.round((seconds + 2**count * unit - 9.3) / unit).astype(np.int64) % 2**count
        return ("time_us" if unit == 1e-6 else "time_ms"), [str(n) for n in whole]
    if trouble == "restart":
        seconds = np.where(seconds > 8.0, seconds - 8.0, seconds + zero)
        zero = 0.0
    if trouble == "shared":
        seconds = np.ceil(seconds * v["rate"] / 2 + 1e-9) * 2 / v["rate"]
    whole = (seconds + zero) / unit
    if decimals == 0:  # more digits than a float has
        parts = np.round(seconds / unit).astype(np.int64) + round(zero / unit)
        return names[v["rate"] % len(names)], [str(n) for n in parts]
    return names[v["rate"] % len(names)], [f"{n:.{decimals}f}" for n in whole]


def table(seconds, columns, v, rng):
    names, stamps = clock(seconds, v)
    order = list(columns)
    if v["shuffle"]:
        rng.shuffle(order)
    texts = [[(v["missing"] if np.isnan(x) else f"{x:.12g}") for x in columns[column]] for column in order]
    rows = [[*stamp, *row] for stamp, row in zip(stamps, zip(*texts))]
    names += order
    if v["comma"] and v["delimiter"] != ",":
        rows = [[text.replace(".", ",") for text in row] for row in rows]
    if v["head"] == "number":
        names, rows = ["", *names], [[str(i), *row] for i, row in enumerate(rows)]
    if v["head"] == "quoted":
        names = [f'"{name}"' for name in names]
    if v["head"] == "units":
        rows.insert(0, [unit_of(name, v) for name in names])
    lines = [v["delimiter"].join(row) for row in [names, *rows]]
    if v["head"] == "comments":
        lines[:0] = ["# exported by a tool", "# flight 7, 2024"]
    if v["head"] == "blank":
        lines[1:1] = [""]
    end = "\r\n" if v["head"] == "crlf" else "\n"
    return ("\ufeff" if v["head"] == "bom" else "") + end.join(lines) + end


def unit_of(name, v):
    """Of a column, in a line of units; with what the table has of no unit."""
    low = name.lower()
    if low in (CLOCKS["s"][0] + CLOCKS["ms"][0] + CLOCKS["us"][0] + CLOCKS["ns"][0]):
        return v["clock"] if not v["trouble"].startswith("wrap") else low[-2:]
    if low in ("vx", "vy", "vz"):
        return "m/s"
    if low in ("roll", "pitch", "yaw"):
        return v["attitude"]
    kinds = dict(zip("agp", NAMES[v["names"]]))
    for kind, unit in (("a", v["accel"]), ("g", v["gyro"]), ("p", v["place"])):
        if name in named(kinds[kind], v) and unit not in ("velocity", "geodetic"):
            return unit
    return "-"


def joined(streams, v):
    """Both streams in one table: positions stay until the next one, or leave other cells empty."""
    (t, imu), (at, path) = streams
    last = np.clip(np.searchsorted(at, t + 1e-9) - 1, 0, len(at) - 1)
    if v["layout"] == "sparse":
        new = np.concatenate([[True], np.diff(last) > 0])
        path = {name: np.where(new, values[last], np.nan) for name, values in path.items()}
        return t, imu | path
    return t, imu | {name: values[last] for name, values in path.items()}


def write(log, v, rng, folder):
    """The value of --in."""
    streams = streams_of(log, v)
    tables = {"imu": streams[0], "position": streams[1]} if v["layout"] == "files" else {"flight": joined(streams, v)}
    paths = []
    for name, (seconds, columns) in tables.items():
        path = folder / f"{name}.csv{v['packed']}"
        path.write_bytes(PACKED[v["packed"]](table(seconds, columns, v, rng).encode()))
        paths.append(str(path))
    return ",".join(paths)


def rms(rows):
    return float(np.sqrt(np.mean(np.sum(rows * rows, axis=1))))


def wrong_places(made, log, v, last):
    """Of positions: missing, of another size, or rows that are no measurement."""
    places = made.mocap if made.has("mocap") else made.fixes if made.has("fixes") else None
    if places is None:
        return ["no position"]
    path = log.mocap.get(PLACE)[log.mocap.t <= last]
    size = [np.sort(np.ptp(rows, axis=0)) for rows in (path, places.get(PLACE))]
    if v["place"] in ("velocity", "geodetic") and v["trouble"] in ("zeros", "held"):
        return []  # of places that were not written
    wrong = ["path"] if np.max(np.abs(size[0] - size[1])) > 0.05 * np.max(size[0]) else []
    rows = places.get(PLACE)
    if v["trouble"] == "zeros" and np.any(np.all(rows == 0, axis=1)):
        wrong.append("zeros")
    changes = np.flatnonzero(np.any(np.diff(rows, axis=0) != 0, axis=1))
    longest = np.max(np.diff(places.t[changes + 1])) * 1e-9
    if v["trouble"] == "held" and longest > 0.3 and len(rows) > 1.2 * len(changes):
        wrong.append("held")
    if len(rows) > 1.5 * (len(changes) + 1):
        wrong.append("repeats")
    return wrong


def wrong_in(made, log, v):
    """What differs from the flight: words of WORDS, each with its size."""
    stamps = stamps_of(log, v)
    span, here = (stamps[-1] - stamps[0]) * 1e-9, (made.imu.t[-1] - made.imu.t[0]) * 1e-9
    wrong = [f"rows {len(made.imu.t)} of {len(stamps)}"] if len(made.imu.t) < 0.98 * len(stamps) else []
    if abs(here - span) > 0.02 * span:
        wrong.append(f"span {here:.4g} of {span:.4g} s")
    during = log.imu.t <= stamps[-1]
    for what, names in (("force", ACCEL), ("rate", GYRO)):
        ratio = rms(made.imu.get(names)) / rms(log.imu.get(names)[during])
        if abs(np.log(ratio)) > 0.1:
            wrong.append(f"{what} x {ratio:.3g}")
    wrong += wrong_places(made, log, v, stamps[-1])
    if not made.has("attitude"):
        return [*wrong, "attitude"]
    q = resampled(made.attitude, QUATERNION, made.imu.t)
    up = np.mean(turn(q, made.imu.get(ACCEL)), axis=0)
    if np.linalg.norm(up - [0, 0, -9.81]) > 3.0:
        wrong.append(f"gravity {np.round(up, 1)}")
    if len(made.imu.t) == len(stamps):
        true = resampled(log.attitude, QUATERNION, stamps)
        turns = [product(np.broadcast_to(inverse(p[:1]), p.shape), p) for p in (true, q)]
        off = np.degrees(2 * np.arccos(np.clip(np.abs(product(inverse(turns[0]), turns[1])[:, 0]), 0, 1)))
        if np.median(off) > 5.0:
            wrong.append(f"turns off by {np.median(off):.0f} deg")
    return wrong


def run(arguments, verb, *flags):
    done = subprocess.run([app(arguments, verb), *flags], capture_output=True, text=True,
                          timeout=120, check=False)
    return done.returncode, done.stdout + done.stderr


# What a warning or a finding must speak of.
WORDS = {"rows": ("left out", "rows_lost", "cut", "restart"), "span": ("left out", "restart", "time_unit"),
         "force": ("accelerometer_scale", "gravity", "accelerometer_bias"), "rate": ("gyro_scale", "attitude_scale", "rates_disagree"),
         "path": ("tracking_lost", "stuck", "position_", "restart"), "zeros": ("tracking_lost",),
         "held": ("stuck",), "repeats": ("repeats",), "attitude": ("attitude_missing",), "no": ("no position",),
         "turns": ("quaternion_form", "body_axes", "imu_axes", "imu)", "attitude", "rates_disagree"),
         "gravity": ("earth_up", "body_up", "body_axes", "gravity", "quaternion_form", "imu_axes", "imu)")}


def untold(wrong, said, findings):
    """Of `wrong` what neither a warning nor a finding above a note speaks of."""
    texts = [line for line in said.splitlines() if line.startswith("warning")]
    texts += [f["id"] for f in findings if f["level"] in ("fatal", "biases", "widens")]
    return [w for w in wrong if not any(word in text for word in WORDS[w.split()[0]] for text in texts)]


def judge(arguments, log, v, rng, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    flags = [f"--in={write(log, v, rng, folder)}", f"--out={folder}/log"]
    code, said = run(arguments, "convert", *flags)
    if "nan" in said.lower().split() or "inf" in said.lower().split():
        return "SILENT", "nan or inf in a message"
    if code in (2, 3):
        return "refused", next(line for line in said.splitlines() if line.startswith("trueline-convert: "))
    if code != 0:
        return "SILENT", f"exit code {code}"
    wrong = wrong_in(Log(folder / "log"), log, v)
    if not wrong:
        return "right", ""
    _, more = run(arguments, "inspect", f"--log={folder}/log", f"--out={folder}/inspection", "--report=false")
    kept = folder / "inspection/inspection.yaml"
    findings = yaml.safe_load(kept.read_text())["findings"] if kept.exists() else []
    left = untold(wrong, said + more, findings)
    return ("SILENT" if left else "said"), f"{', '.join(wrong)}; untold: {', '.join(left)}"


def main():
    arguments = parse()
    arguments.work.mkdir(parents=True, exist_ok=True)
    logs, outcomes, lines = {name: flight(arguments, name) for name in FLIGHTS}, [], []
    for k in range(arguments.count) if arguments.only is None else [arguments.only]:
        rng = random.Random(f"{arguments.seed} {k}")
        v = draw(rng)
        folder = arguments.work / "variant"
        outcome, why = judge(arguments, logs[v["flight"]], v, rng, folder)
        outcomes.append((v["trouble"], outcome))
        if outcome != "right" or arguments.only is not None:
            about = " ".join(f"{key}={value}" for key, value in v.items())
            lines.append(f"- {k} {outcome}: {why[:300]} ({about})")
            print(lines[-1], flush=True)
    count = Counter(outcomes)
    kinds = ("right", "said", "refused", "SILENT")
    rows = [f"| {trouble} | " + " | ".join(str(count[trouble, kind]) for kind in kinds) + " |"
            for trouble in dict.fromkeys(TROUBLES)]
    text = "\n".join(["| trouble | right | said | refused | silent |", "|---|---|---|---|---|", *rows, "", *lines])
    (arguments.work / "variants.md").write_text(text + "\n")
    print("\n".join(text.splitlines()[:len(rows) + 2]))
    sys.exit(any(outcome == "SILENT" for _, outcome in outcomes))


if __name__ == "__main__":
    main()
