#!/usr/bin/python3
"""Writes a native log as the one table that a laboratory's logger might write: LOG OUT.csv

A row for each IMU sample: time in ms, specific force in g and turn rate in deg/s (forward-left-up), the
autopilot's quaternion and Vicon's pose in mm (x north, y west, z up). Vicon is slower: its values are held.
"""
import sys
from pathlib import Path

import numpy as np
import pandas as pd

G = 9.80665  # m/s^2
FLIP = np.array([1.0, -1.0, -1.0])  # forward-right-down to forward-left-up, and north-east-down to north-west-up


def stream(log, name):
    frame = pd.read_csv(Path(log) / f"{name}.csv")
    return frame.rename(columns=lambda column: column.split(" [")[0])


def main(log, out):
    imu, attitude, mocap = (stream(log, name) for name in ("imu", "attitude", "mocap"))
    table = pd.DataFrame({"t_ms": 1e3 * imu.t})
    table[["ax", "ay", "az"]] = imu[["ax", "ay", "az"]] * FLIP / G
    table[["gx", "gy", "gz"]] = np.degrees(imu[["gx", "gy", "gz"]] * FLIP)
    flip = np.array([1.0, *FLIP])
    held = pd.merge_asof(imu[["t"]], attitude, on="t")
    table[["qw", "qx", "qy", "qz"]] = held[["qw", "qx", "qy", "qz"]] * flip
    held = pd.merge_asof(imu[["t"]], mocap, on="t")
    table[["vicon_x", "vicon_y", "vicon_z"]] = 1e3 * held[["x", "y", "z"]] * FLIP
    table[["vicon_qw", "vicon_qx", "vicon_qy", "vicon_qz"]] = held[["qw", "qx", "qy", "qz"]] * flip
    table.to_csv(out, index=False, float_format="%.7g")


if __name__ == "__main__":
    main(*sys.argv[1:])
