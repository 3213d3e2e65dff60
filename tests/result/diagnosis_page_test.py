"""Renders a made-up diagnosis and looks at the page in a real browser."""
import math
import tempfile
import unittest
from pathlib import Path

import yaml

from pages import InFolder, PageCase, render
from synthetic_result import HOSTILE, write_csv

PLOTS = ["plot-places", "plot-growth", "plot-quantities", "plot-fix", "plot-force"]
AXES = ["north", "east", "down", "forward", "right", "below"]
HORIZONS = [0.25, 1.0]
STARTS = 40


def cause(effect, value, unit, **more):
    gain = {"metric": "final_point_error", "before": 0.4, "after": 0.2, "interval95": [0.1, 0.3],
            "arcs": 15}
    open_loop = {"metric": "open_loop_error_1s", "before": 0.3, "after": 0.1,
                 "interval95": [0.15, 0.25], "replays": 50}
    return {"id": effect, "parameters": {"k": {"value": value, "sigma": abs(value) / 10, "unit": unit}},
            "confidence": 0.998, "confused_with": [], "gain": gain, "gain_open_loop": open_loop, **more}


def result():
    growth = [{"horizon_s": h, "replays": STARTS,
               "rms_earth_m": {a: [0.3 * h * h, 0.1 * h * h] for a in ("north", "east", "down")},
               "rms_body_m": {a: [0.3 * h * h, 0.1 * h * h] for a in ("forward", "right", "down")}}
              for h in HORIZONS]
    repeat = {"log": "flights/second", "outcome": "repeats", "p_value": 0.001,
              "parameters": {"k": {"value": 0.031, "sigma": 0.004, "unit": "s/m"}}}
    silent = {"says": "silent", "text": "no stream shows it"}
    lonely = {"log": "flights/second", "outcome": "can't be tested"}
    return {"verdict": "explained", "log_faults": [f"stuck: mocap.csv stands still {HOSTILE}"],
            "causes": [cause("rotor_drag", 0.03, "s/m", confirmed=True, witness=silent, other_flights=[repeat]),
                       cause("gate_moved", 0.5, "m", confirmed=False, other_flights=[lonely])],
            "set_aside": [cause("fix_scale", -0.12, "1", because="refuted by a witness: mocap says no",
                                gain={"metric": "open_loop_error_1s", "before": 0.3, "after": 0.1, "arcs": 50},
                                witness={"says": "refutes", "text": "mocap says no"})],
            "model_lacks": "causes that no other flight confirms",
            "gain": cause("", 1.0, "")["gain"], "goes_with": [f"heading {HOSTILE}"],
            "candidates": [{"id": "wind", "score_z": 1.2, "p_value": 0.31,
                            "detectable_size": {"w_x": 0.21, "w_y": 0.24}}],
            "residual": {"rms_before": 1.9, "rms_after": 1.02, "unit": "sigma", "white": True,
                         "whiteness_p": 0.4, "whiteness_p_before": 0.001},
            "misfit": {"measured_by": "mocap", "growth": growth, "shares_horizon_s": 1.0,
                       "share_of_variance": [
                           {"by": "heading", "body": 0.02, "earth": 0.61, "p_value": 1e-5},
                           {"by": "speed", "body": 0.1, "earth": 0.0, "p_value": 0.3}]},
            "provenance": {"log": f"flights/first {HOSTILE}"}}


def write_result(folder):
    folder.mkdir(parents=True)
    (folder / "diagnosis.yaml").write_text(yaml.safe_dump(result(), sort_keys=False))
    rows = []
    for i in range(STARTS):
        for h in HORIZONS:
            error = 0.3 * h * h * math.sin(i)
            rows.append((float(i) + h, h, *[error] * 6, *[error / 3] * 6, float(i), 2 + math.sin(i),
                         1.0, 9.8, 0.5, math.sin(i), i % 2, 3.0, 1.5, "", math.sin(i), math.cos(i)))
    columns = ",".join(f"{a}_{when} [m]" for when in ("before", "after") for a in AXES)
    write_csv(folder / "misfit.csv",
              f"t [s],horizon [s],{columns},time [s],speed [m/s],acceleration [m/s^2],"
              "thrust [m/s^2],rate [rad/s],heading [rad],gate [1],gate_distance [m],height [m],"
              "battery [V],x [m],y [m]", rows)
    write_csv(folder / "residuals.csv", "t [s],kind,gate [1],x_before [1],y_before [1],z_before [1],"
              "x_after [1],y_after [1],z_after [1]",
              [(0.1 * i, kind, 0, 1.0, -1.0, 0.5, 0.5, -0.5, 0.2)
               for i in range(50) for kind in ("fix", "force")])


class FewReplays(unittest.TestCase):
    """A short flight, or one with few fixes, has few replays over the horizon of the shares or none."""

    def page(self, horizon, starts):
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder) / "result"
            write_result(folder)
            found = result()
            found["misfit"]["shares_horizon_s"] = horizon
            del found["misfit"]["share_of_variance"]
            (folder / "diagnosis.yaml").write_text(yaml.safe_dump(found))
            lines = (folder / "misfit.csv").read_text().splitlines()
            rows = len(HORIZONS) * starts
            (folder / "misfit.csv").write_text("\n".join(lines[:1 + rows]) + "\n")
            outcome = render("diagnosis", folder, folder / "report.html")
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            return (folder / "report.html").read_text()

    def test_what_can_be_drawn_is_drawn(self):
        few, none = self.page(1.0, 3), self.page(2.0, STARTS)
        for page, places in ((few, True), (none, False)):
            self.assertIn('id="plot-growth"', page)
            self.assertNotIn('id="plot-quantities"', page)
            self.assertEqual('id="plot-places"' in page, places)


class PageInBrowser(PageCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        write_result(cls.root / "result")
        page = cls.root / "report.html"
        outcome = render("diagnosis", cls.root / "result", page)
        assert outcome.returncode == 0, outcome.stderr
        cls.plots, cls.errors = cls.open_whole(page, PLOTS)
        cls.browser.run("document.querySelectorAll('details').forEach(d => d.open = true)")

    def test_every_plot_is_drawn_without_errors(self):
        self.assertEqual((self.plots, self.errors), (PLOTS, []))

    def test_text_from_data_can_not_become_markup(self):
        self.assertIsNone(self.browser.run("return window.hacked || null"))

    def test_causes_say_whether_they_repeat_and_what_they_gain(self):
        text = self.text("#verdict")
        for words in ("not confirmed", "flights/second: repeats, k 0.0310 ± 0.0040 s/m",
                      "flights/second: can't be tested", "Set aside", "15 held-out arcs",
                      "50 held-out replays", "All causes together",
                      "Not named: refuted by a witness: mocap says no.",
                      "Witness: no other stream can tell (no stream shows it).",
                      "model.yaml lacks causes that no other flight confirms."):
            self.assertIn(words, text)
        self.assertEqual(text.count("mocap says no"), 1)
        self.assertEqual(text.count("Final-point error"), 3)  # without arcs there is none

    def test_growth_and_shares_are_shown(self):
        self.assertIn("61 %", self.text("#misfit"))
        lines = self.traces("plot-growth")
        self.assertEqual(len(lines), 12)  # six axes before and after
        self.assertTrue(all(points == len(HORIZONS) for _, points in lines))
        needles = [points for _, points in self.traces("plot-places")]
        self.assertEqual(needles, [3 * STARTS, STARTS, 3 * STARTS, STARTS])
        # A quantity that is not logged has no chart.
        titles = self.browser.run("return Object.entries(document.getElementById('plot-quantities')"
                                  ".layout).filter(([k]) => k.startsWith('xaxis'))"
                                  ".map(([, a]) => a.title.text)")
        self.assertIn("speed [m/s]", titles)
        self.assertNotIn("battery [V]", titles)

    def test_the_test_of_whiteness_is_named(self):
        self.assertIn("0.001 before, 0.4 after", self.text("#residuals"))


class Rendering(InFolder):
    def test_a_missing_table_is_named(self):
        write_result(self.root / "result")
        (self.root / "result" / "misfit.csv").unlink()
        outcome = render("diagnosis", self.root / "result", self.root / "report.html")
        self.assertEqual(outcome.returncode, 2)
        self.assertIn("misfit.csv: no such file", outcome.stderr)
        self.assertFalse((self.root / "report.html").exists())


if __name__ == "__main__":
    unittest.main()
