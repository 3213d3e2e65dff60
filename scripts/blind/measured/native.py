"""Native logs as tables, and the rotations that changing them needs.

Quaternions are arrays of rows (w, x, y, z), Hamilton; vectors are arrays of rows (x, y, z).
"""
import shutil
from pathlib import Path

import numpy as np
import yaml

QUATERNION = ("qw", "qx", "qy", "qz")
PLACE = ("x", "y", "z")


class Stream:
    """One CSV file. `t`: whole nanoseconds, because a clock's stamps have more digits than a float."""

    def __init__(self, path):
        lines = path.read_text().splitlines()
        self.header = lines[0].split(",")
        rows = [line.split(",") for line in lines[1:]]
        names = [name.split(" ")[0] for name in self.header]
        self.t = np.array([nanoseconds(row[names.index("t")]) for row in rows], dtype=np.int64)
        self.columns = {name: np.array([float(row[i]) for row in rows])
                        for i, name in enumerate(names) if name != "t"}

    def write(self, path):
        order = [name.split(" ")[0] for name in self.header]
        texts = [[stamp(t) for t in self.t] if name == "t" else
                 [f"{value:.12g}" for value in self.columns[name]] for name in order]
        rows = [",".join(self.header), *(",".join(row) for row in zip(*texts))]
        path.write_text("\n".join(rows) + "\n")

    def get(self, names):
        return np.stack([self.columns[name] for name in names], axis=1)

    def set(self, names, rows):
        for i, name in enumerate(names):
            self.columns[name] = rows[:, i]

    def seconds(self, start):
        """Since `start`, in nanoseconds."""
        return (self.t - start) * 1e-9

    def delay(self, tau):
        self.t = self.t + round(tau * 1e9)


def nanoseconds(text):
    whole, _, part = text.partition(".")
    sign = -1 if whole.startswith("-") else 1
    return int(whole) * 10**9 + sign * int((part + "000000000")[:9])


def stamp(t):
    sign = "-" if t < 0 else ""
    return f"{sign}{abs(int(t)) // 10**9}.{abs(int(t)) % 10**9:09d}"


class Log:
    """A native log's folder in memory. `imu`, `fixes` and so on are its streams."""

    def __init__(self, folder):
        self.about = yaml.safe_load((Path(folder) / "log.yaml").read_text())
        self.streams = {path.stem: Stream(path) for path in sorted(Path(folder).glob("*.csv"))}

    def __getattr__(self, name):
        if name.startswith("_") or name == "streams" or name not in self.streams:
            raise AttributeError(name)
        return self.streams[name]

    def has(self, name):
        return name in self.streams

    def start(self):
        return self.imu.t[0]

    def gate(self, gate):
        """Its entry of the map."""
        return next(entry for entry in self.about["gates"] if entry["id"] == gate)

    def write(self, folder):
        """A folder with a log.yaml is whole: that is written last."""
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        for name, stream in self.streams.items():
            stream.write(folder / f"{name}.csv")
        part = folder / "log.yaml.part"
        part.write_text(yaml.safe_dump(self.about, sort_keys=False))
        part.rename(folder / "log.yaml")


def product(a, b):
    aw, ax, ay, az = a.T
    bw, bx, by, bz = b.T
    return np.stack([aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
                     aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw],
                    axis=1)


def inverse(q):
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def turn(q, v):
    """The vectors `v` rotated by `q`."""
    pure = np.concatenate([np.zeros((len(v), 1)), v], axis=1)
    return product(product(q, pure), inverse(q))[:, 1:]


def about(axis, angle):
    """Rotations by `angle` (one each) about the unit vectors `axis`, or about one of them."""
    half = 0.5 * np.atleast_1d(angle)[:, None]
    return np.concatenate([np.cos(half), np.sin(half) * np.broadcast_to(axis, (len(half), 3))], axis=1)


def from_angles(roll, pitch, yaw):
    """Rotations that turn axes by yaw, then pitch, then roll; each angle an array."""
    return product(product(about([0, 0, 1], yaw), about([0, 1, 0], pitch)), about([1, 0, 0], roll))


def continuous(q):
    """The same rotations with signs that never flip from row to row."""
    flips = np.sign(np.sum(q[1:] * q[:-1], axis=1))
    return q * np.concatenate([[1.0], np.cumprod(np.where(flips < 0, -1.0, 1.0))])[:, None]


def resampled(stream, names, at):
    """Columns at other stamps (nanoseconds), by lines between rows, held at both ends."""
    seconds, wanted = stream.seconds(stream.t[0]), (at - stream.t[0]) * 1e-9
    rows = stream.get(names)
    rows = continuous(rows) if names == QUATERNION else rows
    rows = np.stack([np.interp(wanted, seconds, column) for column in rows.T], axis=1)
    return rows / np.linalg.norm(rows, axis=1)[:, None] if names == QUATERNION else rows
