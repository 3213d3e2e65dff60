#!/usr/bin/python3
"""predictions.csv, scored by an independent implementation of the NanoDrone benchmark's metric, agrees
with summary.yaml by both averages."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

sys.path.append(str(Path(__file__).resolve().parents[1] / "result"))

from schemas import complaints

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BENCHMARK = Path(os.environ["TRUELINE_TEST_BUILD_DIR"]) / "apps" / "trueline-benchmark"
STEPS = 50
UNITS = {"p": "m", "v": "m/s", "R": "rad", "w": "rad/s"}
STATE = ["x", "y", "z", "vx", "vy", "vz", "qw", "qx", "qy", "qz", "wx", "wy", "wz"]
PREDICTED = ["px [m]", "py [m]", "pz [m]", "vx [m/s]", "vy [m/s]", "vz [m/s]", "qw [1]", "qx [1]",
             "qy [1]", "qz [1]", "wx [rad/s]", "wy [rad/s]", "wz [rad/s]"]


def write_run(file, seed, rows):
    """A hover that rolls and pitches a little, with speeds that scatter about hover."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(rows)
    swing = 0.1 * np.sin(np.outer(t, [2.3, 2.7]) + rng.uniform(0, 6, 2))
    rate = np.gradient(swing, 0.01, axis=0)
    q = np.column_stack([np.ones(rows), 0.5 * swing, np.zeros(rows)])
    q /= np.linalg.norm(q, axis=1)[:, None]
    v = np.column_stack([np.cumsum(9.8 * swing[:, 1]), np.cumsum(-9.8 * swing[:, 0]), 0 * t]) * 0.01
    p = np.cumsum(v, axis=0) * 0.01 + [0, 0, 1]
    speeds = 1722 + 10 * rng.normal(size=(rows, 4))
    table = np.column_stack([t, p, v, q, rate, 0 * t, speeds])
    columns = ["t", *STATE, *(f"m{i}_rads" for i in (1, 2, 3, 4))]
    pd.DataFrame(table, columns=columns).to_csv(file, index=False)


def errors(truth, predicted):
    """|p|, |v|, 2 atan2(|u|, s) of conj(q) q' = (s, u) and |w| of arrays (..., 13)."""
    d = predicted - truth
    a, b = truth[..., 6:10], predicted[..., 6:10]
    s = np.sum(a * b, axis=-1)
    u = a[..., :1] * b[..., 1:] - b[..., :1] * a[..., 1:] - np.cross(a[..., 1:], b[..., 1:])
    return np.stack([np.linalg.norm(d[..., :3], axis=-1), np.linalg.norm(d[..., 3:6], axis=-1),
                     2.0 * np.arctan2(np.linalg.norm(u, axis=-1), s),
                     np.linalg.norm(d[..., 10:], axis=-1)], axis=-1)


def within(truths, predictions):
    """Mean over the runs of their means, by step and quantity."""
    means = []
    for truth, predicted in zip(truths, predictions):
        later = np.stack([truth[h:len(truth) - STEPS + h] for h in range(1, STEPS + 1)], axis=1)
        means.append(errors(later, predicted).mean(axis=0))
    return np.mean(means, axis=0)


def concatenated(truths, predictions):
    """Window i at step h against the first-step truth of window i + h - 1 of all runs in a row."""
    first = np.concatenate([truth[1:len(truth) - STEPS + 1] for truth in truths])
    predicted = np.concatenate(predictions)
    return np.stack([errors(first[h:], predicted[:len(predicted) - h, h]).mean(axis=0)
                     for h in range(STEPS)])


class Predictions(unittest.TestCase):
    def run_benchmark(self, folder, config):
        for i, rows in enumerate((231, 220, 225, 218)):
            write_run(folder / "train" / f"{'one' if i < 2 else 'two'}_{i}.csv", i, rows)
        (folder / "config.yaml").write_text(yaml.safe_dump(config))
        subprocess.run([BENCHMARK, f"--config={folder / 'config.yaml'}", f"--data={folder / 'train'}",
                        f"--out={folder / 'out'}", "--short", "--report=false", "--quiet"], check=True)
        return pd.read_csv(folder / "out" / "predictions.csv")

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        (self.folder / "train").mkdir()
        self.config = yaml.safe_load((SOURCE / "config/experiments/nanodrone.yaml").read_text())
        for name, number in self.config["numbers"].items():
            number["free"] = name == "k_f"  # these runs show nothing else
        self.config["effects"] = []
        self.config["numbers"]["b_w"]["start"] = 0.0  # they swing on at any speed
        self.config["processes"]["learn"] = False

    def test_scores_are_those_of_the_summary(self):
        table = self.run_benchmark(self.folder, self.config)
        summary = yaml.safe_load((self.folder / "out" / "summary.yaml").read_text())
        self.assertEqual(complaints(self.folder / "out" / "summary.yaml"), [])
        for trajectory in ("one", "two"):
            truths, predictions = [], []
            for file in sorted((self.folder / "train").glob(f"{trajectory}_*.csv")):
                truths.append(pd.read_csv(file)[STATE].to_numpy())
                rows = table[table["run"] == file.stem]
                windows = len(truths[-1]) - STEPS
                np.testing.assert_array_equal(rows["start row [1]"], np.repeat(np.arange(windows), STEPS))
                np.testing.assert_array_equal(rows["step [1]"], np.tile(np.arange(1, STEPS + 1), windows))
                predictions.append(rows[PREDICTED].to_numpy().reshape(windows, STEPS, 13))
            score = next(s for s in summary["scores"] if s["trajectory"] == trajectory and
                         s["predictor"] == "rotor by rotor")
            for average, means in (("within", within(truths, predictions)),
                                   ("concatenated", concatenated(truths, predictions))):
                for quantity, name in enumerate("pvRw"):
                    stated = score[average][name]
                    self.assertAlmostEqual(means[:, quantity].sum() / stated["sum"], 1.0, delta=1e-3)
                    for h in (1, 10, 50):
                        self.assertAlmostEqual(means[h - 1, quantity] / stated[f"h{h}"], 1.0, delta=2e-3)

    def test_tubes_hold_what_the_summary_says(self):
        table = self.run_benchmark(self.folder, self.config)
        summary = yaml.safe_load((self.folder / "out" / "summary.yaml").read_text())
        for stated in summary["tubes"]:
            wrong, radii = [], {chance: [] for chance in (50, 95)}
            for file in sorted((self.folder / "train").glob(f"{stated['trajectory']}_*.csv")):
                truth, rows = pd.read_csv(file)[STATE].to_numpy(), table[table["run"] == file.stem]
                later = np.concatenate([truth[row + 1:row + STEPS + 1] for row in range(len(truth) - STEPS)])
                wrong.append(errors(later, rows[PREDICTED].to_numpy()).reshape(-1, STEPS, 4))
                for chance, of in radii.items():
                    of.append(rows[[f"{q} {chance} % [{u}]" for q, u in UNITS.items()]].to_numpy()
                              .reshape(-1, STEPS, 4))
            wrong = np.concatenate(wrong)
            for chance, of in radii.items():
                held = (wrong <= np.concatenate(of)).mean(axis=0)
                for quantity, name in enumerate("pvRw"):
                    self.assertAlmostEqual(held[:, quantity].mean(), stated[f"{chance} %"][name]["mean"], delta=2e-3)
                    # The written radii have four digits: one window may change sides.
                    self.assertAlmostEqual(held[49, quantity], stated[f"{chance} %"][name]["h50"],
                                           delta=5e-4 + 1.0 / len(wrong))
            # Two trajectories of one kind: neither tube is empty or holds all.
            self.assertLess(0.2, stated["50 %"]["w"]["mean"])
            self.assertLess(stated["50 %"]["w"]["mean"], 0.8)
            self.assertLess(0.8, stated["95 %"]["w"]["mean"])

    def test_every_nth_start_row(self):
        table = self.run_benchmark(self.folder, {**self.config, "predictions_stride": 40})
        rows = table.loc[table["run"] == "one_0", "start row [1]"]
        np.testing.assert_array_equal(rows, np.repeat([0, 40, 80, 120, 160], STEPS))


if __name__ == "__main__":
    unittest.main()
