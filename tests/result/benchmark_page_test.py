"""Renders a synthetic benchmark and looks at the page in a real browser."""
import math
import unittest

from pages import PageCase, render

HOSTILE = "</script><script>window.hacked=1</script>"
HEADER = ("log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],predicted_sigma [m],"
          "iterations [1],solve_time [s],truth,label,sweep,seed,inside_95 [1],counted [1],bound [m]")
ARCS, SEEDS = 6, 3


def arcs(sweep=("",)):
    lines = [HEADER]
    for x in sweep:
        for seed in range(1, SEEDS + 1):
            for estimator, label, scale, gammas in (("vgd", "VGD", 0.2, (1, 3)),
                                                    ("ekf", "EKF", 0.5, (3,))):
                for gamma in gammas:
                    for tau in range(1, ARCS + 1):
                        error = scale * (1 + 0.3 * math.sin(7 * tau + seed)) * (1 + (x or 0))
                        lines.append(f"oval,{estimator},{gamma},{tau},{tau},{tau + 1},{error},0.2,"
                                     f"{gamma + 2},,mocap,{label},{x},{seed},1,1,0.1")
    return "\n".join(lines) + "\n"


def group(label, estimator, gamma, mean):
    return (f"  - {{log: oval, label: {label}, estimator: {estimator}, gamma: {gamma}, flights: 3, "
            f"arcs: 18, final_point_error: {{mean: {mean}, mean_interval95: [{mean - 0.01}, "
            f"{mean + 0.01}], median: {mean}, p95: 1, rms: {mean}, unit: m}}, inside_95_ellipse: "
            "0.94, iterations: {mean: 5, max: 7}, bound_rms_m: 0.1}\n")


SUMMARY = (f"name: '{HOSTILE}'\nabout: three flights\ngroups:\n" + group("VGD", "vgd", 1, 0.3) +
           group("VGD", "vgd", 3, 0.21) + group("EKF", "ekf", 3, 0.52) +
           "convergence:\n"
           "  - {log: oval, label: VGD, gamma: 1, quantity: b_az, tolerance: 0.1, flights: 3, "
           "converged: 2, median_time_s: 8}\n"
           "  - {log: oval, label: VGD, gamma: 3, quantity: b_az, tolerance: 0.1, flights: 3, "
           "converged: 3, median_time_s: 5}\n"
           "  - {log: oval, label: EKF, gamma: 3, quantity: b_az, tolerance: 0.1, flights: 3, "
           "converged: 2, median_time_s: 21}\n"
           "failures: [{log: oval, seed: 4, reason: the drone left the course}]\n"
           "provenance: {version: '1', seeds: {first: 1, count: 3}}\n")
CONVERGENCE = ("log,label,gamma,sweep,seed,quantity,tolerance,windows,time [s]\n"
               "oval,VGD,3,,1,b_az,0.1,6,4\noval,VGD,3,,2,b_az,0.1,6,5\noval,VGD,3,,3,b_az,0.1,6,6\n"
               "oval,VGD,1,,1,b_az,0.1,6,7\noval,VGD,1,,2,b_az,0.1,6,8\noval,VGD,1,,3,b_az,0.1,6,\n"
               "oval,EKF,3,,1,b_az,0.1,6,20\noval,EKF,3,,2,b_az,0.1,6,21\noval,EKF,3,,3,b_az,0.1,6,\n")


def trajectory():
    lines = ["label,kind,tau,t [s],x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]"]
    for label, kind in (("truth", "mocap"), ("fixes", "fix"), ("VGD", "fit"), ("VGD", "prediction"),
                        ("EKF", "prediction")):
        lines += [f"{label},{kind},1,{0.1 * i},{math.cos(0.1 * i)},{math.sin(0.1 * i)},-1,"
                  + (",," if kind == "fix" else f"{-math.sin(0.1 * i)},{math.cos(0.1 * i)},0")
                  for i in range(60)]
    return "\n".join(lines) + "\n"


def estimates():
    lines = ["label,tau,t [s],name,unit,value,sigma,truth"]
    for label, parameter, unit in (("VGD", "b_az", "m/s^2"), ("EKF", "b_az", "m/s^2"),
                                   ("EKF", "b_gx", "rad/s")):
        lines += [f"{label},{tau},{4 * tau},{parameter},{unit},{0.1 + 0.01 * tau},0.02,0.15"
                  for tau in range(1, ARCS + 1)]
    return "\n".join(lines) + "\n"


class PageInBrowser(PageCase):
    def write(self, sweep=("",), extras=True):
        (self.root / "arcs.csv").write_text(arcs(sweep))
        (self.root / "summary.yaml").write_text(SUMMARY)
        for name, text in (("convergence.csv", CONVERGENCE), ("trajectory.csv", trajectory()),
                           ("estimates.csv", estimates())):
            (self.root / name).unlink(missing_ok=True)
            if extras:
                (self.root / name).write_text(text)

    def render(self):
        return render("benchmark", self.root, self.root / "report.html")

    def open(self, plots):
        outcome = self.render()
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertEqual(self.open_whole(self.root / "report.html", plots), (plots, []))

    def shapes(self, plot):
        return self.browser.run(
            "return document.getElementById(arguments[0]).layout.shapes.map(s => s.y0)", plot)

    def test_every_figure_and_the_papers_figures_are_there(self):
        self.write()
        self.open(["plot-gamma", "plot-arcs", "plot-track", "plot-states", "plot-accel-bias",
                   "plot-gyro-bias", "plot-convergence"])
        states = self.traces("plot-states")
        self.assertEqual(states.count(["Truth (mocap)", 60]), 6)  # position and velocity
        self.assertEqual(states.count(["Fixes", 60]), 3)          # position alone
        self.assertIn(["VGD", ARCS], self.traces("plot-accel-bias"))
        self.assertNotIn(["VGD", ARCS], self.traces("plot-gyro-bias"))
        self.assertEqual(self.shapes("plot-accel-bias"), [0.15])  # the truth
        gamma = self.traces("plot-gamma")
        self.assertIn(["arcs", 2 * SEEDS * ARCS], gamma)
        self.assertIn(["Cramer-Rao bound", 2], gamma)
        self.assertIn(["EKF", ARCS], self.traces("plot-arcs"))
        self.assertEqual(sorted(self.traces("plot-convergence")),  # 0 and the flights that converge
                         [["EKF", 3], ["VGD, gamma 1", 3], ["VGD, gamma 3", 4]])
        self.assertIn(["Truth (mocap)", 60], self.traces("plot-track"))
        paper = self.text("#paper table")
        for words in ("about 0.2 m", "mean 0.21 m (0.2 to 0.22)", "mean 0.52 m", "at most 7",
                      "EKF over VGD, gamma 3", "4.2 (medians 21 s and 5 s)"):
            self.assertIn(words, paper)
        self.assertIn("VGD	1	b_az	0.1	67 %	8", self.text("#convergence table"))
        self.assertIn("left the course", self.text(".warnings"))
        self.assertIsNone(self.browser.run("return window.hacked || null"))

    def test_a_sweep_has_a_curve_for_each_label(self):
        self.write(sweep=(0.02, 0.1, 0.4), extras=False)
        self.open(["plot-sweep"])
        self.assertIn(["VGD", 3], self.traces("plot-sweep"))
        self.assertIn(["EKF", 3], self.traces("plot-sweep"))
        self.assertIn(["Cramer-Rao bound", 3], self.traces("plot-sweep"))

    def test_flights_without_arcs_have_a_page(self):
        self.write()
        (self.root / "arcs.csv").write_text(HEADER + "\n")
        self.open([])

    def test_a_first_flight_without_windows_has_no_track(self):
        self.write()
        lines = trajectory().splitlines(keepends=True)
        (self.root / "trajectory.csv").write_text(
            "".join(lines[:1] + [line for line in lines if line.startswith("fixes,")]))
        self.open(["plot-gamma", "plot-arcs", "plot-accel-bias", "plot-gyro-bias", "plot-convergence"])

    def test_a_missing_table_is_named(self):
        self.write()
        (self.root / "arcs.csv").unlink()
        outcome = self.render()
        self.assertEqual(outcome.returncode, 2)
        self.assertIn("arcs.csv: no such file", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
