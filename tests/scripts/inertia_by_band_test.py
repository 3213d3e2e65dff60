#!/usr/bin/python3
"""scripts/inertia_by_band.py: a gyroscope that turns as moments and hidden disturbances say. The
disturbances are slow and the rotors cancel most of them, as an autopilot makes them do. Low bands then
show too large an inertia, and high bands the body's."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "scripts"))

import numpy as np
import pandas as pd
import yaml
from scipy import signal

from inertia_by_band import flown, row

INERTIA = 2.5e-3  # kg m^2
ARM, K_F, HOVER = 0.1, 1.5e-6, 1000.0
CONFIG = {"vehicle": {"rotors": [
    {"position": [0.0, y * ARM, 0.0], "spin": spin, "k_f": K_F, "k_m": 3e-8}
    for y, spin in ((1, 1), (1, -1), (-1, -1), (-1, 1))]}}


def write_flight(folder, disturbed):
    """40 s at 400 Hz. Thrust is along -z of the body, so a rotor at +y rolls it to the left."""
    rng, t = np.random.default_rng(4), np.arange(0.0, 40.0, 0.0025)
    slow = signal.sosfiltfilt(signal.butter(2, 1.5, fs=400, output="sos"), rng.normal(size=len(t)))
    fast = signal.sosfiltfilt(signal.butter(2, [0.5, 20], "band", fs=400, output="sos"), rng.normal(size=len(t)))
    disturbance = disturbed * slow / slow.std()  # N m
    moment = 0.02 * fast / fast.std() - 0.8 * disturbance
    rate = np.cumsum((moment + disturbance) / INERTIA) * 0.0025
    half = moment / (4.0 * ARM * K_F)  # rad^2/s^2, of each rotor about hover
    speeds = np.sqrt(HOVER ** 2 + np.column_stack([-half, -half, half, half]))
    zeros = np.zeros((len(t), 5))
    pd.DataFrame(np.column_stack([t, zeros[:, :3], rate, zeros[:, 3:]])).to_csv(folder / "imu.csv", index=False)
    pd.DataFrame(np.column_stack([t, speeds])).to_csv(folder / "rotors.csv", index=False)


def roll_inertia(folder, band):
    step, rates, slopes, moments = flown(folder, CONFIG)
    sos = signal.butter(3, band, "band", fs=1.0 / step, output="sos")
    rate, slope, moment = (signal.sosfiltfilt(sos, x, axis=0)[:, 0] for x in (rates, slopes, moments))
    return row(moment, rate, slope)[0]


class InertiaByBand(unittest.TestCase):
    def test_high_bands_show_the_body(self):
        with tempfile.TemporaryDirectory() as folder:
            write_flight(Path(folder), disturbed=0.06)
            self.assertAlmostEqual(roll_inertia(Path(folder), [5, 15]) / INERTIA, 1.0, delta=0.05)
            low = roll_inertia(Path(folder), [0.3, 1.0]) / INERTIA
            self.assertFalse(0.0 < low < 2.0, low)

    def test_every_band_shows_the_body_of_an_undisturbed_flight(self):
        with tempfile.TemporaryDirectory() as folder:
            write_flight(Path(folder), disturbed=0.0)
            for band in ([1, 3], [3, 10], [5, 15]):
                self.assertAlmostEqual(roll_inertia(Path(folder), band) / INERTIA, 1.0, delta=0.05)

    def test_prints_a_table(self):
        with tempfile.TemporaryDirectory() as folder:
            write_flight(Path(folder), disturbed=0.06)
            config = Path(folder) / "config.yaml"
            config.write_text(yaml.safe_dump(CONFIG))
            printed = subprocess.run([SOURCE / "scripts/inertia_by_band.py", f"--log={folder}", f"--config={config}"],
                                     capture_output=True, text=True, check=True).stdout
            self.assertEqual(printed.count("| I_x |"), 4)


if __name__ == "__main__":
    unittest.main()
