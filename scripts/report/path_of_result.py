"""The one path that a calibration states, for other programs: each time once."""
from pathlib import Path

import numpy as np
import pandas as pd

from csv_table import read_table
from errors import ReportError

PATH = ["t", "tau", "x", "y", "z", "vx", "vy", "vz"]
ATTITUDE = ["qw", "qx", "qy", "qz"]


def log_of(arguments, result):
    """The log that --log names, else the one that the result states."""
    if not arguments.log:
        return Path(str((result.get("provenance") or {}).get("log", "")))
    if not (arguments.log / "log.yaml").exists():
        raise ReportError(f"--log={arguments.log}: is no native log; give by --log the one the result was made of")
    return arguments.log


def read_path(result, log):
    """(path, whose attitude): t (s), x, y, z (m, NED), vx, vy, vz (m/s), qw, qx, qy, qz (body to
    earth). Where windows overlap, the last one that holds a time counts, for it has seen most; the whole
    flight counts before windows. A drive that fits no attitude has the logged one."""
    file = result / "trajectory.csv"
    try:
        path = read_table(file, PATH + ATTITUDE, ["kind"])
        source = "as fitted"
    except ReportError:
        path = read_table(file, PATH, ["kind"], "give the result folder of trueline calibrate")
        source = "as logged"
    if (path.kind == "smoothed").any():
        path = path[path.kind == "smoothed"]
    path = path.sort_values(["t", "tau"], kind="stable").drop_duplicates("t", keep="last")
    if path.empty:
        raise ReportError(f"{file}: holds no path; the flight was not fitted")
    if source == "as logged":
        path = _with_logged_attitude(path, log)
    return path.reset_index(drop=True), source


def _with_logged_attitude(path, log):
    """The logged attitude next in time. Samples are closer than the vehicle turns by a degree."""
    logged = read_table(log / "attitude.csv", ["t", *ATTITUDE], may_be_cut_off=True,
                        remedy="give the log that the result was made from by --log")
    return pd.merge_asof(path, logged.sort_values("t"), on="t", direction="nearest")


def unwrapped(quaternions):
    """Of one sign along the path: an interpolation between neighbours is then the short way."""
    q = np.array(quaternions, dtype=float)
    flips = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1, 1))
    q[1:] *= flips[:, None]
    return q
