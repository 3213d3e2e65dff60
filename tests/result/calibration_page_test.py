"""Renders a synthetic calibration result and looks at the page in a real browser."""
import re
import shutil
import unittest
from types import SimpleNamespace

import numpy as np

import synthetic_result as synthetic
from pages import InFolder, PageCase, render
from plots_track import ellipse_95
from truth_file import read_truth

PLOTS = ["plot-parameters", "plot-track", "plot-arcs", "plot-gamma", "plot-residuals",
         "plot-histogram"]
FIXES = 18 * (synthetic.ARCS + 1)


class PageInBrowser(PageCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        log, result = synthetic.write_all(cls.root)
        cls.page = cls.root / "out" / "report.html"
        outcome = render("calibration", result, cls.page, f"--log={log}")
        assert outcome.returncode == 0, outcome.stderr
        assert [p.name for p in cls.page.parent.iterdir()] == ["report.html"]
        cls.plots, cls.errors = cls.open_whole(cls.page, PLOTS)

    def test_every_plot_is_drawn_without_errors(self):
        self.assertEqual((self.plots, self.errors), (PLOTS, []))

    def test_the_page_is_small_enough_to_send(self):
        self.assertLess(self.page.stat().st_size, 1.5e6)

    def test_nothing_comes_from_the_network(self):
        requested = self.browser.run(
            "return performance.getEntriesByType('resource').map(e => e.name)")
        self.assertEqual([name for name in requested if not name.startswith("data:")], [])
        linked = self.browser.run(
            "return [...document.querySelectorAll('[src],link[href]')]"
            ".map(e => e.getAttribute('src') || e.getAttribute('href'))")
        self.assertEqual([name for name in linked if re.match(r"(https?:)?//", name)], [])

    def test_text_from_data_can_not_become_markup(self):
        self.assertIsNone(self.browser.run("return window.hacked || null"))
        self.assertIn(synthetic.HOSTILE, self.text("h1"))
        self.assertIn(synthetic.HOSTILE, self.text(".verdict"))

    def test_headline_says_verdict_figures_and_warnings(self):
        self.assertTrue(self.text(".verdict.poor strong").startswith("Poor"))
        self.assertIn("0.21 m", self.text(".tiles"))
        self.assertIn("94 %", self.text(".tiles"))
        self.assertIn("gap of 0.03 s", self.text(".warnings"))

    def test_parameter_table_has_values_units_and_states(self):
        table = self.text("#parameters table")
        self.assertIn("−0.550 ± 0.040", table)
        self.assertIn("1.15 ± 0.23", table)  # 0.02 +- 0.004 rad in degrees
        badges = self.browser.run(
            "return [...document.querySelectorAll('#parameters .badge')].map(b => b.innerText)")
        self.assertEqual(badges, ["identified", "identified", "weak", "identified",
                                  "unobservable", "at bound"])
        self.assertIn("psi_E_Ep +0.04 rad with psi_I_B", self.text("#parameters"))

    def test_the_whole_flight_has_its_own_table(self):
        text = self.text("#whole-flight")
        self.assertIn("2 flights of this vehicle at once: 30 passes", text)
        self.assertIn("K_y is not read from the accelerometer", text)
        self.assertIn("0.0075 to 0.0139", text)

    def test_track_has_fixes_paths_ends_and_ellipses(self):
        traces = dict(self.traces("plot-track"))
        self.assertEqual(traces["Fixes"], FIXES)
        self.assertEqual(traces["VGD, final points"], synthetic.ARCS)
        self.assertEqual(traces["True final points"], synthetic.ARCS)
        self.assertEqual(traces["VGD, 95 % ellipses"], synthetic.ARCS * 34)
        self.assertGreater(traces["Mocap"], 1000)
        self.assertGreater(traces["VGD, predicted"], 100)
        self.assertIn("EKF, fitted", traces)
        scale = self.browser.run(
            "const l = document.getElementById('plot-track')._fullLayout;"
            "return [Math.abs(l.xaxis._m), Math.abs(l.yaxis._m), l.xaxis.title.text]")
        self.assertAlmostEqual(scale[0], scale[1], delta=1e-6 * scale[0])  # equal axes
        self.assertEqual(scale[2], "y, east [m]")

    def test_ellipse_holds_95_percent_of_its_normal(self):
        covariance = np.array([[0.09, 0.03], [0.03, 0.04]])
        x, y = ellipse_95(SimpleNamespace(x_predicted=1.0, y_predicted=-2.0, cov_xx=0.09,
                                          cov_xy=0.03, cov_yy=0.04), points=721)
        information = np.linalg.inv(covariance)
        offsets = np.stack([x - 1.0, y + 2.0])
        on_edge = np.einsum("in,ij,jn->n", offsets, information, offsets)
        np.testing.assert_allclose(on_edge, -2 * np.log(0.05), rtol=1e-3)

    def test_errors_are_shown_by_arc_and_by_gamma(self):
        self.assertIn(f"{synthetic.ARCS - 1} of {synthetic.ARCS}", self.text("#errors table"))
        by_arc = dict(self.traces("plot-arcs"))
        self.assertEqual(by_arc["VGD"], synthetic.ARCS - 1)  # one arc has no truth
        gamma = self.traces("plot-gamma")
        self.assertIn(["VGD, arcs", 3 * (synthetic.ARCS - 1)], gamma)   # errors
        self.assertIn(["VGD, arcs", 3 * synthetic.ARCS], gamma)         # iterations
        self.assertEqual(gamma.count(["VGD, mean", 3]), 2)
        self.assertEqual(gamma.count(["EKF, median", 3]), 2)

    def test_parameters_are_shown_by_window(self):
        traces = self.traces("plot-parameters")
        self.assertEqual(len(traces), 2 * len(synthetic.PARAMETERS))
        self.assertTrue(all(points == synthetic.ARCS for _, points in traces))
        titles = self.browser.run("return document.getElementById('plot-parameters')"
                                  ".layout.annotations.map(a => a.text)")
        self.assertEqual(titles[:3], ["K_x [1/s]", "K_y [1/s]", "b_az [m/s^2]"])

    def test_each_fix_has_one_residual(self):
        self.assertEqual(self.traces("plot-residuals"), [["x", FIXES], ["y", FIXES]])
        names = [name for name, _ in self.traces("plot-histogram")]
        self.assertEqual(names, ["x", "y", "Standard normal (assumed)"])
        area = self.browser.run("return document.getElementById('plot-histogram').data[0].y"
                                ".reduce((a, b) => a + b) * 0.25")
        self.assertAlmostEqual(area, 1.0, delta=0.01)

    def test_hovering_shows_the_values(self):
        place = self.browser.run(
            "const p = document.getElementById('plot-arcs');"
            "p.scrollIntoView({block: 'center', behavior: 'instant'});"
            "const m = p.querySelector('.scatterlayer .trace .points path');"
            "const r = m.getBoundingClientRect();"
            "return [r.x + r.width / 2, r.y + r.height / 2]")
        self.browser.move_to(*place)
        hover = self.browser.wait_for(
            "const h = document.querySelector('#plot-arcs .hoverlayer .hovertext');"
            "return h ? h.textContent : ''")
        self.assertIn("arc 1", hover)
        self.assertIn("predicted sigma", hover)


class Rendering(InFolder):
    def test_errors_name_the_file_and_what_would_do(self):
        log, result = synthetic.write_all(self.root, rate=8)
        out = self.root / "report.html"

        def spoil_a_number():
            lines = (result / "residuals.csv").read_text().split("\n")
            lines[4] = lines[4].replace("0.15", "wide")
            (result / "residuals.csv").write_text("\n".join(lines))

        cases = [
            (spoil_a_number, "residuals.csv:5: 'wide' in column 'sigma'"),
            (lambda: (result / "arcs.csv").unlink(), "arcs.csv: no such file; give the folder"),
            (lambda: (result / "arcs.csv").write_text("log,estimator\n"),
             "arcs.csv:1: column 'gamma' is missing"),
            (lambda: (result / "calibration.yaml").write_text("verdict: fine\n"),
             "'verdict' is 'fine'; expected usable, poor or unusable"),
            (lambda: (result / "calibration.yaml").write_text("verdict: [\n"), "line 2"),
            (lambda: (log / "log.yaml").unlink(), "--log must be a native log"),
        ]
        for spoil, message in cases:
            shutil.rmtree(log), shutil.rmtree(result)
            synthetic.write_all(self.root, rate=8)
            spoil()
            outcome = render("calibration", result, out, f"--log={log}")
            self.assertEqual(outcome.returncode, 2, outcome.stderr)
            self.assertIn(message, outcome.stderr)
            self.assertFalse(out.exists())

    def test_a_last_line_that_is_cut_off_is_left_out(self):
        log, result = synthetic.write_all(self.root, rate=8)
        with open(log / "fixes.csv", "a") as file:
            file.write("99.5,1.0,-")
        outcome = render("calibration", result, self.root / "report.html", f"--log={log}")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)

    def test_an_unusable_flight_has_a_page_without_tables(self):
        log, result = synthetic.write_all(self.root, rate=8)
        for table in result.glob("*.csv"):
            table.unlink()
        (result / "calibration.yaml").write_text(
            "verdict: unusable\nreasons: [the drone hovered]\nparameters: {}\n")
        outcome = render("calibration", result, self.root / "report.html", f"--log={log}")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        page = (self.root / "report.html").read_text()
        self.assertIn("the drone hovered", page)
        self.assertIn("No fix was fitted.", page)

    def test_a_long_log_stays_below_ten_megabytes(self):
        log, result = synthetic.write_all(self.root, rate=2000)
        out = self.root / "report.html"
        outcome = render("calibration", result, out, f"--log={log}")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertGreater((result / "trajectory.csv").stat().st_size, 5e6)
        self.assertLess(out.stat().st_size, 10e6)


class TruthBesideTheLog(InFolder):
    TRUTH = ("parameters:\n  K_x: {value: -0.5, unit: 1/s}\n"
             "imu: {accel_bias: [0.08, -0.06, 0.15], gyro_bias: [0.004, -0.003, 0.002]}\n")

    def setUp(self):
        super().setUp()
        self.log, self.result = synthetic.write_all(self.root, rate=8)

    def page(self, truth):
        if truth:
            self.log.with_name(self.log.name + ".truth.yaml").write_text(self.TRUTH)
        out = self.root / "page.html"
        outcome = render("calibration", self.result, out, f"--log={self.log}/")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        return out.read_text()

    def test_it_is_read_by_name(self):
        self.assertEqual(read_truth(self.log), {})
        self.page(truth=True)
        truth = read_truth(self.log)
        self.assertEqual((truth["K_x"], truth["b_ay"], truth["b_gz"]), (-0.5, -0.06, 0.002))

    def test_the_table_shows_it_with_the_error_in_sigmas(self):
        self.assertNotIn("Error / sigma", self.page(truth=False))
        page = self.page(truth=True)
        self.assertIn("Error / sigma", page)
        self.assertRegex(page, r"[-−]1\.2")  # K_x: -0.55 +- 0.04 against -0.5


if __name__ == "__main__":
    unittest.main()
