#!/usr/bin/python3
"""Inertia about each axis as a flight shows it in one band of frequencies after the other.

    scripts/inertia_by_band.py --log=logs/flight --config=config/calibrate/rotors_neurobem.yaml

Regresses the gyroscope's slope on the rotors' moment (places, spins, k_f and k_m of the configuration)
and the turn rate, all band-passed, and prints inertia (kg m^2; sigma by leaving out one of ten parts of
the flight), damping of the turn rate (1/s) and the share of the slope's variance that both explain.
Where an autopilot holds the attitude, slow moments cancel disturbances that no log has: the lower the
band, the larger the inertia seems. A band that explains most of its slopes shows the body's inertia, up
to the rotors' own lag.
"""
import argparse
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from scipy import signal

BANDS = [(0.3, 1.0), (1.0, 3.0), (3.0, 10.0), (5.0, 15.0)]  # Hz
PARTS = 10


def moments_of(speeds, config):
    """N m about the centre of mass, by time and body axis; moments of the accelerated rotors left out."""
    vehicle = config["vehicle"]
    centre = np.array(vehicle.get("r_BM", [0.0, 0.0, 0.0]))
    total = np.zeros((len(speeds), 3))
    for i, rotor in enumerate(vehicle["rotors"]):
        axis = np.array(rotor.get("axis", [0.0, 0.0, -1.0]))
        per_square = (rotor["k_f"] * np.cross(np.array(rotor["position"]) - centre, axis)
                      + rotor["spin"] * rotor["k_m"] * axis)
        total += speeds[:, i:i + 1] ** 2 * per_square
    return total


def flown(log, config):
    """Steps (s), turn rates, their slopes and moments on the gyroscope's stamps between start and end."""
    imu, rotors = pd.read_csv(log / "imu.csv"), pd.read_csv(log / "rotors.csv")
    t = imu.iloc[:, 0].to_numpy()
    rates = imu.iloc[:, 4:7].to_numpy()
    at = rotors.iloc[:, 0].to_numpy()
    speeds = np.column_stack([np.interp(t, at, rotors.iloc[:, 1 + i]) for i in range(rotors.shape[1] - 1)])
    within = (t >= t[0] + config.get("start", 0.0)) & (t <= t[-1] - config.get("end", 0.0))
    step = float(np.median(np.diff(t)))
    return step, rates[within], np.gradient(rates[within], step, axis=0), moments_of(speeds, config)[within]


def fit(moment, rate, slope):
    """(1 / inertia, damping) of the least squares."""
    return np.linalg.lstsq(np.column_stack([moment, rate]), slope, rcond=None)[0]


def row(moment, rate, slope):
    whole = fit(moment, rate, slope)
    parts = np.array_split(np.arange(len(slope)), PARTS)
    left_out = [1.0 / fit(*(np.delete(x, part) for x in (moment, rate, slope)))[0] for part in parts]
    sigma = np.sqrt((PARTS - 1) * np.var(left_out))
    rest = slope - np.column_stack([moment, rate]) @ whole
    return 1.0 / whole[0], sigma, whole[1], 1.0 - np.var(rest) / np.var(slope)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--log", type=Path, required=True)
    parser.add_argument("--config", type=Path, required=True)
    arguments = parser.parse_args()
    for file in (arguments.config, arguments.log / "imu.csv", arguments.log / "rotors.csv"):
        if not file.exists():
            parser.error(f"{file}: there is no such file; a native log with rotor speeds is needed")
    config = yaml.safe_load(arguments.config.read_text())
    step, rates, slopes, moments = flown(arguments.log, config)
    print("| band, Hz | axis | inertia, kg m^2 | damping, 1/s | explained |\n|---|---|---|---|---|")
    for low, high in BANDS:
        if high > 0.4 / step:
            continue
        band = signal.butter(3, [low, high], "band", fs=1.0 / step, output="sos")
        rate, slope, moment = (signal.sosfiltfilt(band, x, axis=0) for x in (rates, slopes, moments))
        for i, axis in enumerate("xyz"):
            inertia, sigma, damping, share = row(moment[:, i], rate[:, i], slope[:, i])
            print(f"| {low:g} to {high:g} | I_{axis} | {inertia:.2e} +- {sigma:.1e} | {-damping:.1f} | {100 * share:.0f} % |")


if __name__ == "__main__":
    main()
