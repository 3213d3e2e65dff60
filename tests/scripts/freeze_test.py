#!/usr/bin/python3
"""The comparison of scripts/freeze: what counts as the same, and what does not."""
import copy
import os
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
sys.path[:0] = [str(SOURCE / "scripts/freeze"), str(SOURCE / "scripts/blind")]

from decisions import compare, read


def estimate(value, sigma, **more):
    return {"value": value, "sigma": sigma, "unit": "1", **more}


WIND = {"id": "wind", "confidence": 1, "confirmed": False, "confused_with": ["quadratic_drag"],
        "parameters": {"w_x": estimate(1.0, 0.1), "w_y": estimate(0.5, 0.1)},
        "gain": {"before": 0.5, "after": 0.3, "arcs": 9}}
MOVED = {"id": "gate_moved", "confused_with": [], "parameters": {"gate": {"value": 1}, "dx": estimate(0.3, 0.05)}}
DIAGNOSIS = {"verdict": "explained", "causes": [WIND], "goes_with": ["speed (12 %)"], "candidates": [],
             "misfit": {"growth": [{"horizon_s": 1.0, "rms_earth_m": {"north": [0.3, 0.1]}}]}}
HIDDEN = {"flown": True, "effects": [{"id": "wind", "w_x": 1.1, "w_y": 0.5}]}
CALIBRATION = {"verdict": "usable", "parameters": {"K_x": estimate(-0.5, 0.02, status="identified")},
               "arcs": {"final_point_error": {"mean": 0.25, "unit": "m"}, "inside_95_ellipse": 0.95}}


class Freeze(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def results(self, side, **files):
        work = self.folder / side
        for part, node in {"blind_imu/results/f/diagnosis": DIAGNOSIS, "blind_imu/sealed/f.hidden": HIDDEN,
                           "blind_imu/g/calibration": CALIBRATION, **files}.items():
            path = work / f"{part}.yaml"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(yaml.safe_dump(node))
        return read(work, "blind_imu")

    def compared(self, edit, of=DIAGNOSIS):
        """What an edit of one result changes: {what: note}."""
        now = copy.deepcopy(of)
        edit(now)
        name = "blind_imu/results/f/diagnosis" if of is DIAGNOSIS else "blind_imu/g/calibration"
        comparison = compare(self.results("before"), self.results("after", **{name: now}))
        return {what: note for _, what, _, _, note in comparison.changed}

    def test_same_is_same(self):
        comparison = compare(self.results("before"), self.results("after"))
        self.assertEqual(comparison.changed, [])
        self.assertGreater(comparison.same, 15)

    def test_words(self):
        self.assertEqual(list(self.compared(lambda r: r.update(verdict="clean"))), ["verdict"])
        self.assertEqual(list(self.compared(lambda r: r["causes"][0].update(confirmed=True))),
                         ["causes.wind.confirmed"])
        self.assertIn("causes.wind.confused_with", self.compared(lambda r: r["causes"][0]["confused_with"].clear()))
        self.assertEqual(self.compared(lambda r: r.update(goes_with=["speed (14 %)"], next=["confirm it"])), {})

    def test_a_further_cause_is_told_once(self):
        changed = self.compared(lambda r: r["causes"].append(MOVED))
        self.assertEqual([what for what in changed if not what.startswith("judged")], ["causes"])

    def test_order_of_causes(self):
        both = {**DIAGNOSIS, "causes": [WIND, MOVED]}
        swapped = {**DIAGNOSIS, "causes": [MOVED, WIND]}
        name = "blind_imu/results/f/diagnosis"
        changed = compare(self.results("before", **{name: both}), self.results("after", **{name: swapped})).changed
        self.assertEqual([what for _, what, *_ in changed], ["causes"])

    def test_estimates_in_sigmas(self):
        def value(number, sigma=0.1):
            return lambda r: r["causes"][0]["parameters"].update(w_x=estimate(number, sigma))
        self.assertEqual(self.compared(value(1.04)), {})
        self.assertIn("moved 0.60 sigmas", self.compared(value(1.06))["causes.wind.parameters.w_x"])
        self.assertEqual(self.compared(value(1.0, 0.108)), {})
        self.assertEqual(list(self.compared(value(1.0, 0.112))), ["causes.wind.parameters.w_x"])
        self.assertEqual(list(self.compared(value(1.0, 0.089))), ["causes.wind.parameters.w_x"])

    def test_what_was_hidden_judges(self):
        away = self.compared(lambda r: r["causes"][0]["parameters"].update(w_x=estimate(0.8, 0.1)))
        self.assertIn("judged.parameters within 2 sigma", away)

    def test_status_errors_and_counts(self):
        def error(value):
            return lambda r: r["arcs"]["final_point_error"].update(mean=value)
        weak = self.compared(lambda r: r["parameters"]["K_x"].update(status="weak"), CALIBRATION)
        self.assertEqual(list(weak), ["parameters.K_x"])
        self.assertEqual(self.compared(error(0.256), CALIBRATION), {})
        self.assertEqual(list(self.compared(error(0.26), CALIBRATION)), ["arcs.final_point_error.mean"])
        self.assertEqual(list(self.compared(lambda r: r["arcs"].update(inside_95_ellipse=0.94), CALIBRATION)),
                         ["arcs.inside_95_ellipse"])
        self.assertEqual(list(self.compared(lambda r: r["causes"][0]["gain"].update(after=0.4))),
                         ["causes.wind.gain.after"])

    def test_missing(self):
        was = self.results("before")
        self.assertEqual({now for *_, now, _ in compare(was, {}).changed}, {"missing"})
        self.assertEqual(compare(was, {}, some=True).changed, [])

    def test_speeds_never_change(self):
        comparison = compare({"speed/vgd_bench/speed.yaml": {"a": 1.0, "b": 1.0}},
                             {"speed/vgd_bench/speed.yaml": {"a": 1.1, "b": 1.2}})
        self.assertEqual((comparison.changed, len(comparison.speeds)), ([], 1))


if __name__ == "__main__":
    unittest.main()
