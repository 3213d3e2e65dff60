"""Pages in a real browser at two widths: the answer first, nothing sideways, dark, and on paper."""
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import yaml

import browser
import diagnosis_page_test
import synthetic_result as synthetic
from pages import BUILD, SOURCE, PageCase, render

WIDTHS = [1100, 390]        # CSS pixels: a small screen and a telephone; other tests open pages at 1366
PAPER = 720                 # of a sheet of A4 between its margins
READY = "return [...document.querySelectorAll('div.plot')].every(p => p.querySelector('.main-svg'))"


def sized(value, sigma, unit):
    return {"value": value, "sigma": sigma, "unit": unit}


def inspection():
    finding = {"id": "gaps", "stream": "imu", "level": "biases", "size": 0.4, "unit": "s",
               "text": f"samples are missing from 4 s to 4.4 s {synthetic.HOSTILE}", "remedy": "log the IMU first",
               "repaired": False}
    axis = {"unit": "m/s^2", "quantum": 0, "noise_density_per_sqrt_Hz": 0.01, "above_20_Hz_rms": 0.3, "line_Hz": 30,
            "cutoff_Hz": 0, "spikes": 0}
    rates = {"stream": "attitude", "what": "turn rates against the gyroscope", "shown": True, "correlation": 0.99,
             "late_by": sized(0.05, 0.001, "s"), "turned_by": {"value": [0.1, 0.2, 0.3], "sigma": [0.01] * 3,
                                                               "unit": "deg"},
             "size_ratio": sized(1.0, 0.01, 1), "mirrored": False}
    health = {"samples": 3000, "rate_Hz": 200, "jitter_s": 0, "gaps": 1, "longest_gap_s": 0.4, "repeats": 0,
              "spikes": 0}
    return {"log": "flight", "findings": [finding], "comparisons": [rates], "not_checked": ["rotors: none are logged"],
            "streams": [{"stream": "imu", **health, "axes": [{"axis": "ax", **axis}]}]}


def write_inspected(root):
    """A vehicle that nods; the attitude's stamps are 0.05 s late, the IMU pauses once."""
    log, result = root / "inspected", root / "inspection"
    for folder in (log, result):
        folder.mkdir()
    times = [t for t in np.arange(0, 15, 0.005) if not 4.0 < t < 4.4]
    synthetic.write_csv(log / "imu.csv", "t [s],ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]",
                        [(float(t), 0.1, 0.0, -9.81, 0.0, float(np.cos(t)), 0.0) for t in times])
    synthetic.write_csv(log / "attitude.csv", "t [s],qw [1],qx [1],qy [1],qz [1]",
                        [(float(t + 0.05), float(np.cos(np.sin(t) / 2)), 0.0, float(np.sin(np.sin(t) / 2)), 0.0)
                         for t in np.arange(0, 15, 0.01)])
    (result / "inspection.yaml").write_text(yaml.safe_dump(inspection()))
    return log, result


def write_multi_step(folder):
    """A benchmark of one trajectory with errors at every horizon, fitted without another one."""
    folder.mkdir()
    errors = {q: {h: 12.345 for h in ("h1", "h10", "h50", "sum")} for q in "pvRw"}
    held = {q: {h: 0.95 for h in ("h1", "h10", "h50", "mean")} for q in "pvRw"}
    number = {"value": 0.123456, "sigma": 0.0123, "unit": "kg m^2", "status": "fitted", "about": "inertia about x_B"}
    fit = {"trained_on": ["Random"], "numbers": {"I_x": number},
           "processes": {axis: {"strengths": [0.1234, 1.234]} for axis in ("level", "heading")}}
    score = {"trajectory": "Chirp", "predictor": "rotor by rotor", "concatenated": errors, "within": errors}
    (folder / "summary.yaml").write_text(yaml.safe_dump({
        "name": "nano-drones", "scores": [score], "fit": fit, "folds": {name: fit for name in ("Chirp", "Square")},
        "published": [{"name": "physics with a residual network", "average": "concatenated", "sums": [1, 2, 3, 4],
                       **{h: [0.1, 0.2, 0.3, 0.4] for h in ("h1", "h10", "h50")}}],
        "tubes": [{"trajectory": "Chirp", "50 %": held, "95 % learned": held}]}))
    synthetic.write_csv(folder / "horizons.csv", "trajectory,predictor,average,horizon,p,v,R,w",
                        [("Chirp", "rotor by rotor", "within", step, *[0.01 * step] * 4) for step in range(1, 51)])


def fly_by_rotors(root):
    """Results of the rotor drive: a calibration, an audit of its export with ten times the mass, a comparison."""
    def run(*command):
        subprocess.run([BUILD / "apps/trueline", *command, "--quiet"], cwd=root, check=True)
    for seed in (1, 2, 3):
        run("simulate", f"--config={SOURCE}/config/rotors/random.yaml", f"--seed={seed}", f"--out=flown_{seed}")
    run("calibrate", "--drive=rotors", f"--config={SOURCE}/config/calibrate/rotors.yaml", "--log=flown_1",
        "--out=rotors", "--report=false")
    run("export", "--model=rotors/model.yaml", "--to=rotorpy", "--out=wrong.yaml")
    file = root / "wrong.yaml"
    file.write_text(re.sub(r"(mass: *)([\d.]+)", lambda found: f"{found[1]}{10 * float(found[2])}", file.read_text()))
    run("audit", "--simulator=wrong.yaml", "--out=audit", "--report=false")
    run("diagnose", "--log=flown_1", "--against=flown_2,flown_3", "--out=against", "--report=false")


@unittest.skipUnless(shutil.which("chromedriver"), "SKIPPED: no chromedriver, no page was looked at")
class Pages(PageCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        log, result = synthetic.write_all(cls.root)
        diagnosis_page_test.write_result(cls.root / "diagnosis")
        inspected, inspection_result = write_inspected(cls.root)
        cls.pages = {}
        fly_by_rotors(cls.root)
        write_multi_step(cls.root / "multi_step")
        for verb, folder, more in (("calibration", result, [f"--log={log}"]), ("diagnosis", cls.root / "diagnosis", []),
                                   ("inspection", inspection_result, [f"--log={inspected}"]),
                                   ("rotors", cls.root / "rotors", []), ("audit", cls.root / "audit", []),
                                   ("multi_step", cls.root / "multi_step", []),
                                   ("diagnosis", cls.root / "against", [])):
            page = cls.root / f"{folder.name}.html"
            outcome = render(verb, folder, page, *more)
            assert outcome.returncode == 0, outcome.stderr
            cls.pages[verb if folder.name != "against" else "against"] = page

    def each_page(self):
        for width in WIDTHS:
            for verb, page in self.pages.items():
                with self.subTest(verb, width=width):
                    self.browser.resize(width, 900)
                    self.browser.open(page.as_uri())
                    self.browser.wait_for(READY)
                    yield verb, width

    def test_the_answer_is_on_the_first_screen_and_nothing_is_cut(self):
        for verb, width in self.each_page():
            answer = "table" if verb == "multi_step" else ".verdict"
            bottom = self.browser.run(f"return document.querySelector('{answer}').getBoundingClientRect().bottom")
            self.assertLess(bottom, 760)
            self.assertLessEqual(*self.browser.run(
                "return [document.documentElement.scrollWidth, document.documentElement.clientWidth]"))
            self.browser.run("document.querySelectorAll('details').forEach(d => d.open = true)")
            wide = self.browser.run("return [...document.querySelectorAll('.scroll')].filter("
                                    "s => s.scrollWidth > s.clientWidth + 1).map(s => s.innerText.slice(0, 80))")
            if width >= 1100:
                self.assertEqual(wide, [])
            else:
                self.assertEqual(self.browser.run(
                    "return [...document.querySelectorAll('.js-plotly-plot')].filter(p => new Set(Object.keys(p.layout)"
                    ".filter(k => /^xaxis/.test(k)).map(k => (p.layout[k].domain || [0])[0])).size > 1).map(p => p.id)"), [])
            self.assertEqual([m for m in self.browser.console() if m["level"] == "SEVERE"], [])
            self.assertIsNone(self.browser.run("return window.hacked || null"))

    def test_on_paper_plots_fit_and_details_are_open(self):
        self.browser.resize(1366, 900)
        self.browser.open(self.pages["diagnosis"].as_uri())
        self.browser.wait_for(READY)
        self.browser.run("dispatchEvent(new Event('beforeprint'))")
        widths = self.browser.wait_for(
            "const w = [...document.querySelectorAll('.main-svg')].map(s => s.clientWidth).filter(w => w > 0);"
            f"return w.every(w => w <= {PAPER}) && w")
        self.assertGreater(len(widths), 3)
        self.assertEqual(self.browser.run("return document.querySelectorAll('details:not([open])').length"), 0)
        self.browser.run("dispatchEvent(new Event('afterprint'))")
        self.browser.wait_for("return document.querySelectorAll('details:not([open])').length > 0")

    def test_an_inspection_draws_what_it_compared(self):
        self.browser.open(self.pages["inspection"].as_uri())
        self.browser.wait_for(READY)
        names = self.browser.run("return [...document.querySelectorAll('.js-plotly-plot')].map(p => p.id)")
        self.assertEqual(names, ["plot-time", "plot-overlays", "plot-spectra"])
        reference, stream = self.browser.run(
            "return document.getElementById('plot-overlays').data.map(d => [d.x, d.y])")
        moved = np.interp(reference[0], *stream)  # at the best lag the two agree
        self.assertLess(np.median(np.abs(moved - np.array(reference[1]))), 0.02)
        findings = self.browser.run("return document.getElementById('plot-time').data.filter("
                                    "d => d.marker && d.marker.symbol == 'diamond').map(d => d.x)")
        self.assertEqual(findings, [[4, 4.4]])


@unittest.skipUnless(shutil.which("chromedriver"), "SKIPPED: no chromedriver, no page was looked at")
class Dark(unittest.TestCase):
    def test_text_stands_out_from_its_ground(self):
        root = Path(self.enterContext(tempfile.TemporaryDirectory()))
        diagnosis_page_test.write_result(root / "diagnosis")
        render("diagnosis", root / "diagnosis", root / "page.html")
        self.addCleanup(browser.FLAGS.remove, "--blink-settings=preferredColorScheme=0")
        browser.FLAGS.append("--blink-settings=preferredColorScheme=0")
        with browser.Browser() as dark:
            dark.open((root / "page.html").as_uri())
            dark.wait_for(READY)
            self.assertTrue(dark.run("return matchMedia('(prefers-color-scheme: dark)').matches"))
            for selector in ("section p", "section td", ".verdict strong"):
                ink, ground = dark.run(
                    "const e = document.querySelector(arguments[0]), c = s => s.match(/[0-9.]+/g).slice(0, 3).map(Number);"
                    "return [c(getComputedStyle(e).color), c(getComputedStyle(e.closest('section')).backgroundColor)]",
                    selector)
                self.assertGreater(sum(ink) - sum(ground), 200, selector)
            dark.wait_for("return document.querySelector('.gtitle, .xtick text').style.fill == 'rgb(223, 229, 236)'")


if __name__ == "__main__":
    unittest.main()
