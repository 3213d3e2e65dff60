#!/usr/bin/python3
"""scripts/blind/measured: what it writes into a log is what the program names, with sign and size.
The log is that of a made flight, clean by itself. TRUELINE_TEST_ALL=1 tries every effect of the IMU
drive (13 diagnoses), not three."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])
for folder in ("freeze", "blind", "blind/measured"):
    sys.path.insert(0, str(SOURCE / "scripts" / folder))

import numpy as np
import yaml

from changes import CHANGES, acceleration, mocap_repeats_attitude
from draw_hidden import NEEDS, draw_effect, times
from judge_measured import combined, judge_trial, untouched_rows
from measured_flights import ALL, HIDDEN_IN, halves
from native import QUATERNION, Log, nanoseconds, resampled, stamp
from program import drawn_effects

QUICK = {"fix_latency": {"tau": 0.12}, "tilt_scale": {"s": 0.15},
         "imu_lever_arm": {"r_x": 0.08, "r_y": -0.06, "r_z": 0.06}}
OTHERS = {"gate_moved": {"gate": 2, "dx": 0.7, "dy": -0.6, "dz": 0.3},
          "false_gate": {"gate": -1, "dx": 1.5, "dy": 1.5, "dz": 0.0, "fraction": 0.15,
                         "whole_passes": False, "pick": 1},
          "accel_scale_z": {"s": -0.2}, "accel_bias_drift": {"d": 0.006},
          "ahrs_acceleration_error": {"k": 0.7}, "ahrs_drag_error": {"k": 0.5}, "heading_drift": {"d": -0.006},
          "heading_distortion": {"a_sin": 0.15, "a_cos": -0.15}, "attitude_latency": {"tau": 0.08},
          "fix_scale": {"s": -0.12}, "camera_misalignment": {"roll": 0.0, "pitch": 0.1, "yaw": -0.1}}
CLEAN = {"verdict": "clean", "causes": [], "candidates": []}


def run(verb, *flags):
    subprocess.run([BUILD / f"apps/trueline-{verb}", "--quiet", *flags], check=True)


class Made(unittest.TestCase):
    """Changes of a made flight of the course `fast`."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.work = Path(cls.folder.name)
        run("simulate", f"--config={SOURCE}/config/simulate/fast.yaml", f"--out={cls.work}/log", "--seed=3",
            "--overrides=imu.rate: 128")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def log(self):
        return Log(self.work / "log")

    def check_named(self, effect, parameters):
        log, hidden = self.log(), {"id": effect, **parameters}
        CHANGES[effect](log, hidden)
        log.write(self.work / effect)
        run("diagnose", f"--log={self.work / effect}", f"--out={self.work}/{effect}_result", "--report=false")
        diagnosis = yaml.safe_load((self.work / f"{effect}_result/diagnosis.yaml").read_text())
        record = judge_trial(hidden, CLEAN, diagnosis, len(log.about["gates"]))
        self.assertTrue(record["first"], f"{effect}: {record['named']}")
        self.assertEqual(record["false"], [], effect)
        estimates = record["estimate"]["parameters"]
        for name, (value, sigma) in estimates.items():
            if sigma is not None:
                error = abs(value - hidden[name])
                self.assertLess(error, 3 * sigma + 0.1 * abs(hidden[name]), f"{effect} {name}: {estimates}")

    def test_named_with_sign_and_size(self):
        every = {**QUICK, **(OTHERS if "TRUELINE_TEST_ALL" in os.environ else {})}
        for effect, parameters in every.items():
            with self.subTest(effect):
                self.check_named(effect, parameters)

    def test_untouched_is_written_as_read(self):
        log = self.log()
        log.write(self.work / "copy")
        again = Log(self.work / "copy")
        self.assertEqual(again.about, log.about)
        for name, stream in log.streams.items():
            np.testing.assert_array_equal(again.streams[name].t, stream.t)
            for column, values in stream.columns.items():
                np.testing.assert_allclose(again.streams[name].columns[column], values, atol=1e-9)

    def test_mocap_may_repeat_the_attitude_at_stamps_of_its_own(self):
        log = self.log()
        self.assertFalse(mocap_repeats_attitude(log))
        log.mocap.delay(0.0037)
        log.mocap.set(QUATERNION, resampled(log.attitude, QUATERNION, log.mocap.t))
        self.assertTrue(mocap_repeats_attitude(log))

    def test_acceleration_is_that_of_the_path(self):
        log = self.log()
        inner = log.mocap.t[200:-200:50]
        t = log.mocap.seconds(log.start())
        log.mocap.set(("x", "y", "z"), np.stack([1.5 * t**2, -0.5 * t**2, 0 * t], axis=1))
        np.testing.assert_allclose(acceleration(log, inner), np.tile([3.0, -1.0, 0.0], (len(inner), 1)),
                                   atol=1e-4)
        log.mocap.t = np.where(np.arange(len(log.mocap.t)) > 1000, log.mocap.t + 10**9, log.mocap.t)
        outage = np.array([log.mocap.t[1000] + 5 * 10**8])
        np.testing.assert_array_equal(acceleration(log, outage), np.zeros((1, 3)))


class Rules(unittest.TestCase):
    def test_stamps_keep_nanoseconds(self):
        for text in ("1772426886.221071482", "0.000000000", "-1.500000000"):
            self.assertEqual(stamp(nanoseconds(text)), text)

    def test_halves(self):
        of = halves()
        self.assertEqual(set(of), set(HIDDEN_IN))
        for source in {map_name for map_name, _ in HIDDEN_IN.values()}:
            flights = [of[name] for name in HIDDEN_IN if ALL[name][0] == source]
            self.assertLessEqual(abs(flights.count("tune") - flights.count("report")), 1)

    def test_sizes_are_multiples_of_what_is_detectable(self):
        import random
        drawn = drawn_effects(BUILD, "imu")
        diagnosis = {"candidates": [{"id": "fix_scale", "detectable_size": {"s": 0.05}},
                                    {"id": "camera_misalignment", "detectable_size":
                                     {"roll": 5.0, "pitch": 0.03, "yaw": 0.03}},
                                    {"id": "gate_moved", "which": "gate_moved 3",
                                     "detectable_size": {"dx": 1e12, "dy": 1e12, "dz": 1e12}}]}
        rng, about = random.Random(1), {"gates": [{"id": 3}]}
        for effect in ("fix_scale", "camera_misalignment"):
            for from_counted, low, high in ((False, 0.49, 2.01), (True, 1.99, 4.01)):
                sizes = [times(draw_effect(rng, effect, from_counted, drawn[effect], diagnosis, about),
                               diagnosis) for _ in range(50)]
                self.assertTrue(low <= min(sizes) < 1.3 * low and 0.7 * high < max(sizes) <= high, sizes)
        self.assertIsNone(draw_effect(rng, "gate_moved", False, drawn["gate_moved"], diagnosis, about))
        self.assertLessEqual(set(NEEDS["imu"]) - {"accel_bias"}, set(drawn) | {"tilt_scale"})

    def test_sampled_fixes_have_no_error(self):
        moved = {"verdict": "explained", "causes": [{"id": "gate_moved"}, {"id": "wind"}]}
        lines = untouched_rows([("a", "fixes", True, moved), ("b", "fixes", False, moved),
                                ("c", "fixes", True, CLEAN)])
        self.assertEqual([("false: gate_moved |" in line) for line in lines[2:5]], [True, False, False])
        self.assertIn("1 of 2", lines[-1])

    def test_judge(self):
        cause = lambda name, **p: {"id": name, "confused_with": [], "parameters": {
            key: {"value": value, "sigma": 0.01} for key, value in p.items()}}
        hidden = {"id": "fix_scale", "s": 0.1}
        own = {**CLEAN, "causes": [cause("tilt_scale", s=0.1)],
               "candidates": [{"id": "fix_scale", "detectable_size": {"s": 0.04}}]}
        both = {**CLEAN, "causes": [*own["causes"], cause("fix_scale", s=0.11)]}
        record = judge_trial(hidden, own, both, 4)
        self.assertTrue(record["first"] and not record["false"])
        self.assertEqual((record["times"], record["within"]), (2.5, [1, 1]))
        wrong = {**CLEAN, "causes": [cause("wind", w_x=1.0)]}
        record = judge_trial(hidden, own, wrong, 4)
        self.assertEqual(([c["id"] for c in record["false"]], record["lost"]), (["wind"], ["tilt_scale"]))
        self.assertAlmostEqual(combined(hidden, cause("fix_scale", s=0.2))["s"], 0.32)
        upon = {**own, "causes": [cause("fix_scale", s=0.2)]}
        unmoved = judge_trial(hidden, upon, {**both, "causes": [cause("fix_scale", s=0.21)]}, 4)
        self.assertFalse(unmoved["at_all"] or unmoved["false"])
        self.assertTrue(judge_trial(hidden, upon, {**both, "causes": [cause("fix_scale", s=0.3)]}, 4)["first"])
        other = {**CLEAN, "causes": [{**cause("gate_moved", dx=0.5), "confused_with": []}]}
        other["causes"][0]["parameters"]["gate"] = {"value": 1}
        moved = {"id": "gate_moved", "gate": 0, "dx": 0.5, "dy": 0.0, "dz": 0.0}
        self.assertFalse(judge_trial(moved, own, other, 4)["at_all"])
        self.assertTrue(judge_trial(moved, own, other, 2)["at_all"])


if __name__ == "__main__":
    unittest.main()
