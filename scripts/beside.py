#!/usr/bin/python3
"""One rigid window of VGD beside what a user would write otherwise: time, memory, result.

    scripts/beside.py [--build=build]

Flies config/simulate/hippodrome.yaml for 50 s and fits the three passes up to the tenth: by the
library, by a plain Ceres problem of AutoDiff residuals (both in tests/bench/vgd_bench.cc, built by
`ninja -C build vgd_bench`), and by NumPy and SciPy, here. All integrate eq. 28 of Li et al. 2019 by
the midpoint rule. Needs python3-pandas and python3-scipy.
"""
import argparse
import json
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation, Slerp

SOURCE = Path(__file__).resolve().parents[1]
GAMMA, TAU, HUBER, GRAVITY = 3, 10, 2.5, 9.81
MEAN = np.array([-0.5, -0.5] + [0.0] * 7)
SIGMA = np.array([0.29, 0.29, 0.58] + [np.radians(1.73)] * 6)


def window(log):
    """Steps (length, attitude, thrust-axis acceleration) and fixes (place in steps, position, sigma)."""
    imu, attitude, fixes = (pd.read_csv(log / f"{name}.csv") for name in ("imu", "attitude", "fixes"))
    t = fixes["t [s]"].to_numpy()
    runs = np.concatenate([[0], np.cumsum(np.diff(t) > 0.7)])
    passes = np.flatnonzero(np.bincount(runs) >= 3)[TAU - GAMMA:TAU]
    fixes = fixes[np.isin(runs, passes)]
    t = imu["t [s]"].to_numpy()
    first = np.searchsorted(t, fixes["t [s]"].min()) - 1
    last = np.searchsorted(t, fixes["t [s]"].max())
    turn = Slerp(attitude["t [s]"], Rotation.from_quat(attitude.iloc[:, [2, 3, 4, 1]]))
    middle = 0.5 * (t[first:last] + t[first + 1:last + 1])
    place = np.interp(fixes["t [s]"], t[first:last + 1], np.arange(last - first + 1))
    return (np.diff(t[first:last + 1]), turn(middle).as_matrix(), imu["az [m/s^2]"].to_numpy()[first:last],
            place, fixes.iloc[:, 1:4].to_numpy(), fixes["sigma [m]"].to_numpy())


def paths(x, steps, attitude, a_z):
    """Positions at the steps' ends for each row of x: nine parameters, then position and velocity."""
    def turned(angles):
        return Rotation.from_euler("xyz", angles).as_matrix().transpose(0, 2, 1)
    to_earth, to_body = turned(x[:, 3:6]).transpose(0, 2, 1), turned(x[:, 6:9])
    p, v = x[:, 9:12].copy(), x[:, 12:15].copy()
    out = np.empty((len(steps) + 1, *p.shape))
    out[0] = p
    down = np.array([0.0, 0.0, GRAVITY])
    for k, dt in enumerate(steps):
        R = to_earth @ attitude[k] @ to_body.transpose(0, 2, 1)

        def acceleration(at):
            force = x[:, :2] * np.einsum("nij,ni->nj", R, at)[:, :2]
            z = (a_z[k] - x[:, 2] - (to_body[:, :2, 2] * force).sum(1)) / to_body[:, 2, 2]
            return np.einsum("nij,nj->ni", R, np.column_stack([force, z])) + down
        change = acceleration(v + 0.5 * dt * acceleration(v)) * dt
        p = p + dt * (v + 0.5 * change)
        v = v + change
        out[k + 1] = p
    return out


def by_numpy(log):
    steps, attitude, a_z, at, fixes, sigma = window(log)

    def residuals(x):
        path = paths(x, steps, attitude, a_z)
        before = np.minimum(at.astype(int), len(steps) - 1)
        share = (at - before)[:, None, None]
        there = (1 - share) * path[before] + share * path[before + 1]
        error = (there.transpose(1, 0, 2) - fixes) / sigma[:, None]
        norm = np.linalg.norm(error, axis=2, keepdims=True)
        robust = np.where(norm > HUBER, np.sqrt(HUBER * np.abs(2 * norm - HUBER)), norm)
        error *= robust / np.maximum(norm, 1e-12)
        return np.concatenate([error.reshape(len(x), -1), (x[:, :9] - MEAN) / SIGMA], axis=1)

    def slopes(x):
        h = 1e-6
        both = residuals(np.vstack([x, x + h * np.eye(len(x))]))
        return (both[1:] - both[0]).T / h
    start = np.concatenate([MEAN, fixes[0], np.zeros(3)])
    began = time.perf_counter()
    found = least_squares(lambda x: residuals(x[None])[0], start, slopes, ftol=1e-4, x_scale="jac")
    return time.perf_counter() - began, found.x[:2]


def by_bench(build, name):
    command = [build / "tests/vgd_bench", f"--benchmark_filter={name}", "--benchmark_format=json"]
    run = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)["benchmarks"][0]
    return run["cpu_time"] * 1e-6, (run.get("K_x"), run.get("K_y"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    build = parser.parse_args().build.resolve()
    bare, _ = by_bench(build, "BarePass")
    rows, most = [], 0
    for name, bench in (("trueline", "FullSolve/rigid:1"), ("plain Ceres", "PlainCeres")):
        seconds, drag = by_bench(build, bench)
        most = max(most, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
        rows.append((name, seconds, most, drag))
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "flight.yaml"
        text = (SOURCE / "config/simulate/hippodrome.yaml").read_text()
        config.write_text("".join(f"{line}\n" for line in text.splitlines() if not line.startswith("duration:")) +
                          "duration: 50\n")
        log = Path(folder) / "log"
        subprocess.run([build / "apps/trueline-simulate", f"--config={config}", "--seed=1", f"--out={log}",
                        "--quiet"], check=True)
        seconds, drag = by_numpy(log)
    rows.append(("NumPy and SciPy", seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, drag))
    print(f"{'':16} {'ms':>9} {'bare passes':>12} {'memory, MB':>11} {'K_x, 1/s':>9} {'K_y, 1/s':>9}")
    for name, seconds, memory, (k_x, k_y) in rows:
        print(f"{name:16} {1e3 * seconds:9.2f} {seconds / bare:12.0f} {memory / 1024:11.0f} {k_x:9.4f} {k_y:9.4f}")


main()
