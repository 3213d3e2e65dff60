#!/usr/bin/python3
"""The comparison of scripts/freeze: what counts as the same, what does not, and what is better."""
import copy
import os
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "scripts/freeze"))

import kept
from compare import compare
from truth import judge_change

WIND = {"id": "wind", "confused_with": ["quadratic_drag"],
        "parameters": {"w_x": [1.0, 0.1], "w_y": [0.5, 0.1]}, "gain": [0.5, 0.3]}
MOVED = {"id": "gate_moved", "confirmed": False, "confused_with": [],
        "parameters": {"gate": 1, "dx": [0.3, 0.05]}}
BLIND = {"hidden": [{"id": "wind", "w_x": 1.2, "w_y": 0.5}], "verdict": "explained",
         "causes": [WIND], "errors": {"open loop 1 s": [0.3, 0.1]}}
CALIBRATION = {"exit": 0, "verdict": "usable", "parameters": {"K_x": [-0.5, 0.02, "identified"]},
               "errors": {"vgd mean": 0.25}, "counts": {"arcs": 16}}


def changes(was, edit):
    """Changes that `edit` makes of a record, by what changed."""
    now = copy.deepcopy(was)
    edit(now)
    return {change.what: change for change in compare({"f": was}, {"f": now}).changed}


def judged(edit, what):
    now = copy.deepcopy(BLIND)
    edit(now)
    return judge_change(changes(BLIND, edit)[what], BLIND, now)


class Compare(unittest.TestCase):
    def test_same_is_same(self):
        comparison = compare({"f": BLIND, "g": CALIBRATION}, {"f": BLIND, "g": CALIBRATION})
        self.assertEqual((comparison.same, comparison.changed), (13, []))

    def test_words(self):
        self.assertEqual(list(changes(BLIND, lambda r: r.update(verdict="clean"))), ["verdict"])
        self.assertEqual(list(changes(BLIND, lambda r: r["causes"][0]["confused_with"].clear())),
                         ["wind.confused_with"])
        self.assertEqual(list(changes(BLIND, lambda r: r["causes"][0].update(confirmed=True))),
                         ["wind.confirmed"])
        self.assertEqual(list(changes(CALIBRATION, lambda r: r["counts"].update(arcs=15))),
                         ["counts.arcs"])

    def test_a_further_cause_is_one_change(self):
        self.assertEqual(list(changes(BLIND, lambda r: r["causes"].append(MOVED))), ["causes"])

    def test_order_of_causes(self):
        was = {**BLIND, "causes": [WIND, MOVED]}
        self.assertEqual(list(changes(was, lambda r: r["causes"].reverse())), ["causes"])

    def test_estimates_in_sigmas(self):
        def value(number, sigma=0.1):
            return lambda r: r["causes"][0]["parameters"].update(w_x=[number, sigma])
        self.assertEqual(changes(BLIND, value(1.04)), {})
        self.assertIn("moved 0.60 sigmas", changes(BLIND, value(1.06))["wind.w_x"].note)
        self.assertEqual(changes(BLIND, value(1.0, 0.108)), {})
        self.assertEqual(list(changes(BLIND, value(1.0, 0.112))), ["wind.w_x"])
        self.assertEqual(list(changes(BLIND, value(1.0, 0.089))), ["wind.w_x"])

    def test_status(self):
        weak = {"K_x": [-0.5, 0.02, "weak"]}
        self.assertEqual(list(changes(CALIBRATION, lambda r: r.update(parameters=weak))),
                         ["parameters.K_x"])

    def test_errors(self):
        self.assertEqual(changes(CALIBRATION, lambda r: r["errors"].update({"vgd mean": 0.256})), {})
        self.assertEqual(list(changes(CALIBRATION, lambda r: r["errors"].update({"vgd mean": 0.26}))),
                         ["errors.vgd mean"])
        self.assertEqual(list(changes(BLIND, lambda r: r["causes"][0].update(gain=[0.5, 0.4]))),
                         ["wind.gain"])

    def test_missing(self):
        self.assertEqual([c.now for c in compare({"f": BLIND}, {}).changed], ["missing"])
        self.assertEqual([c.was for c in compare({}, {"f": BLIND}).changed], ["missing"])
        self.assertEqual(list(changes(CALIBRATION, lambda r: r["errors"].clear())),
                         ["errors.vgd mean"])

    def test_speeds_never_change(self):
        comparison = compare({"f": {"speeds": {"a": 1.0, "b": 1.0}}},
                             {"f": {"speeds": {"a": 1.1, "b": 1.2}}})
        self.assertEqual((len(comparison.changed), len(comparison.slower)), (0, 1))


class Truth(unittest.TestCase):
    def test_causes(self):
        self.assertEqual(judged(lambda r: r["causes"].append(MOVED), "causes"), "worse")
        self.assertEqual(judged(lambda r: r["causes"].clear(), "causes"), "worse")

    def test_verdict(self):
        self.assertEqual(judged(lambda r: r.update(verdict="unexplained"), "verdict"), "worse")

    def test_value(self):
        closer = judged(lambda r: r["causes"][0]["parameters"].update(w_x=[1.15, 0.1]), "wind.w_x")
        self.assertEqual(closer, "2.0 -> 0.5 sigmas off the truth, better")

    def test_a_move_of_the_other_gate_is_the_opposite(self):
        hidden = {"id": "gate_moved", "gate": 0, "dx": -0.4, "dy": 0.0, "dz": 0.0}
        was = {"hidden": [hidden], "verdict": "explained", "causes": [MOVED]}
        now = copy.deepcopy(was)
        now["causes"][0]["parameters"]["dx"] = [0.4, 0.05]
        change, = compare({"f": was}, {"f": now}).changed
        self.assertIn("2.0 -> 0.0 sigmas off the truth, better", judge_change(change, was, now))


class Kept(unittest.TestCase):
    def test_reads_what_it_wrote(self):
        outcome = {"rates": {"both named": [8, 9]}, "flights": {"f, 1": BLIND, "g": CALIBRATION}}
        with tempfile.TemporaryDirectory() as folder:
            kept.write("part", outcome, Path(folder) / "kept")
            self.assertEqual(kept.read("part", Path(folder) / "kept"), outcome)
            self.assertEqual(kept.read("nothing", Path(folder)), {})


if __name__ == "__main__":
    unittest.main()
