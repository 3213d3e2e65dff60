#!/usr/bin/python3
"""The Python module: its results are those of the command line, its errors say the same."""
import inspect
import os
import subprocess
import sys
import tempfile
import typing
import unittest
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])
sys.path.insert(0, str(BUILD / "python"))
try:
    import trueline
except ModuleNotFoundError as error:
    print(f"SKIPPED: {error}")  # a build without pybind11, or under the sanitizers
    sys.exit(0)

warnings.simplefilter("ignore", trueline.TruelineWarning)
CONFIG = SOURCE / "config"


def command(verb, **flags):
    """Standard error of a run; its exit code is in the second place."""
    done = subprocess.run([BUILD / f"apps/trueline-{verb}", *[f"--{k}={v}" for k, v in flags.items()]],
                          capture_output=True, text=True, check=False)
    return done.stderr, done.returncode


def error_of(text):
    """The last error that a program printed, without its name."""
    lines = [line for line in text.splitlines() if ": error: " in line]
    return lines[-1].split(": error: ", 1)[1]


class Module(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.work = Path(cls.scratch.name)
        cls.log = trueline.simulate(CONFIG / "simulate/hippodrome.yaml", seed=5, duration=30.0,
                                    out=cls.work / "log")
        cls.result = trueline.calibrate(cls.log, out=cls.work / "python", gamma_sweep="2,3")
        command("calibrate", log=cls.log.folder, out=cls.work / "programs", gamma_sweep="2,3")
        cls.rotor_log = trueline.simulate(CONFIG / "rotors/random.yaml", seed=3, out=cls.work / "rotors")
        cls.rotors = trueline.calibrate(cls.rotor_log, drive="rotors", report=False,
                                        config=CONFIG / "calibrate/rotors.yaml", out=cls.work / "model")

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def test_results_are_those_of_the_command_line(self):
        for name in ("calibration.yaml", "model.yaml", "residuals.csv", "trajectory.csv"):
            self.assertEqual((self.work / "python" / name).read_bytes(),
                             (self.work / "programs" / name).read_bytes(), name)

    def test_entries_and_tables_hold_the_files_numbers(self):
        stated = yaml.safe_load((self.work / "programs/calibration.yaml").read_text())
        self.assertEqual(self.result.verdict, stated["verdict"])
        for name, parameter in stated["parameters"].items():
            self.assertEqual(self.result.parameters[name].value, float(parameter["value"]))
        table = pd.read_csv(self.work / "programs/trajectory.csv")
        self.assertEqual(len(self.result.trajectory), len(table))
        for column, name in zip(table.columns, self.result.trajectory.dtype.names):
            np.testing.assert_array_equal(table[column], self.result.trajectory[name])
            self.assertEqual(column.split(" ")[0], name)
        self.assertEqual(self.result.trajectory.dtype["t"].metadata["unit"], "s")
        self.assertIn("trajectory", self.result.tables)
        with self.assertRaisesRegex(AttributeError, "neither an entry"):
            self.result.nothing_of_that_name

    def test_plot_is_the_report(self):
        page = self.result.plot()
        self.assertIn("plotly", page.path.read_text().lower())
        self.assertIn("<iframe", page._repr_html_())
        with self.assertRaises(FileNotFoundError):
            self.rotors.plot()

    def test_a_seed_flies_the_same_flight(self):
        command("simulate", config=CONFIG / "simulate/hippodrome.yaml", seed=5, duration=30,
                out=self.work / "again")
        for name in ("imu.csv", "fixes.csv"):
            self.assertEqual((self.work / "log" / name).read_bytes(), (self.work / "again" / name).read_bytes())
        self.assertEqual(self.log.truth.seed, 5)

    def test_errors_say_what_the_command_line_says(self):
        cases = [("calibrate", dict(log="/no/such/log", out=self.work / "none")),
                 ("calibrate", dict(log=self.work / "log", out=self.work / "none", drive="wings")),
                 ("diagnose", dict(log=self.work / "log", out=self.work / "none", alpha=2.0)),
                 ("inspect", dict(log=self.work / "log", out=self.work / "none", fail_on="rain")),
                 ("design", dict(config="/no/such.yaml", out=self.work / "none")),
                 ("simulate", dict(config=CONFIG / "calibrate/paper.yaml", out=self.work / "none")),
                 ("audit", dict(simulator=self.work / "log/log.yaml", out=self.work / "none")),
                 ("calibrate", dict(log=self.work / "log", out="/proc/none"))]
        for verb, flags in cases:
            with self.assertRaises(trueline.InputError) as caught:
                getattr(trueline, verb)(**flags)
            text, code = command(verb, **flags)
            self.assertEqual(code, 2)
            self.assertEqual(str(caught.exception), error_of(text))

    def test_no_usable_log_is_an_error_of_its_own(self):
        table = self.work / "temperature.csv"
        table.write_text("t [s],temperature\n" + "".join(f"{k},{20 + k}\n" for k in range(50)))
        with self.assertRaises(trueline.NoUsableResult) as caught:
            trueline.convert(table, out=self.work / "converted")
        text, code = command("convert", **{"in": table, "out": self.work / "converted"})
        self.assertEqual(code, 3)
        self.assertEqual(str(caught.exception), error_of(text))

    def test_arguments_are_checked_by_kind(self):
        with self.assertRaisesRegex(TypeError, "gamma: int is needed"):
            trueline.calibrate(self.log, gamma="three")
        with self.assertRaisesRegex(TypeError, "unexpected keyword"):
            trueline.calibrate(self.log, gama=3)
        with self.assertRaisesRegex(TypeError, "log: a text"):
            trueline.calibrate(3)

    def test_exit_codes_and_flags_last_for_one_call(self):
        refused = trueline.inspect(self.log, report=False, fail_on="warning")
        self.assertEqual(refused.exit_code, 4 if refused.values.findings and
                         refused.values.findings[0].level != "note" else 0)
        hover = trueline.simulate(CONFIG / "simulate/hover.yaml", duration=20.0)
        self.assertEqual(trueline.calibrate(hover, report=False, fail_on="poor").exit_code, 4)
        unusable = trueline.calibrate(hover, report=False)
        self.assertEqual((unusable.exit_code, unusable.verdict), (3, "unusable"))

    def test_a_mapping_is_a_configuration(self):
        config = yaml.safe_load((CONFIG / "simulate/hippodrome.yaml").read_text())
        log = trueline.simulate(config, seed=5, duration=30.0)
        self.assertEqual((log.folder / "imu.csv").read_bytes(), (self.work / "log/imu.csv").read_bytes())

    def test_logs_come_from_arrays(self):
        streams = self.log.streams
        self.assertEqual(streams["imu"].dtype.names, ("t", "ax", "ay", "az", "gx", "gy", "gz"))
        copy = trueline.Log(**streams, **{k: v for k, v in self.log.about.items() if k != "source"})
        for name in streams:
            self.assertEqual((copy.folder / f"{name}.csv").read_bytes(),
                             (self.log.folder / f"{name}.csv").read_bytes(), name)
        again = trueline.calibrate(copy, gamma_sweep="2,3", report=False)
        self.assertEqual(again.parameters, self.result.parameters)
        imu = np.column_stack([streams["imu"][name] for name in streams["imu"].dtype.names])
        fixes = streams["fixes"]
        self.assertEqual(len(trueline.Log(imu=imu, fixes=fixes).imu), len(imu))
        mapping = {name: streams["imu"][name] for name in streams["imu"].dtype.names}
        np.testing.assert_array_equal(trueline.Log(imu=mapping, fixes=fixes).imu.ax, streams["imu"].ax)

    def test_arrays_that_are_no_log_are_refused(self):
        imu = np.zeros((10, 7))
        with self.assertRaisesRegex(trueline.InputError, "imu.csv:3: .*t"):
            trueline.Log(imu=imu)  # all samples at one time
        with self.assertRaisesRegex(trueline.InputError, "imu: an array of 7 columns"):
            trueline.Log(imu=imu[:, :5])
        with self.assertRaisesRegex(trueline.InputError, "a log has the streams imu"):
            trueline.Log(imu=imu, radar=imu)

    def test_warnings_are_pythons(self):
        config = yaml.safe_load((CONFIG / "simulate/hippodrome.yaml").read_text())
        config.pop("randomise", None)
        with self.assertWarnsRegex(trueline.TruelineWarning, "randomise"):
            trueline.simulate(config, duration=5.0, randomise=True)

    def test_replay_and_score(self):
        measured = trueline.states(self.rotor_log, self.rotors)
        flown = trueline.replay(self.rotors, self.rotor_log, start=5.0, seconds=1.0)
        self.assertEqual(flown.dtype.names, trueline.STATE.names)
        self.assertAlmostEqual(flown.t[-1] - flown.t[0], 1.0, delta=0.05)
        errors, mean = trueline.score(flown, measured)
        self.assertLess(errors.p[0], 1e-9)
        # Of the start's velocity, by poses of 1 cm, and of white disturbances.
        self.assertLess(mean.p, 0.25)
        # A model with another thrust falls off by half its acceleration times t^2.
        model = yaml.safe_load((self.rotors.folder / "model.yaml").read_text())
        model["parameters"]["m"]["value"] *= 1.2
        heavy = self.work / "heavy/model.yaml"
        heavy.parent.mkdir()
        heavy.write_text(yaml.safe_dump(model))
        drop = trueline.replay(heavy, self.rotor_log, start=5.0, seconds=1.0)
        self.assertAlmostEqual(np.linalg.norm([drop[c][-1] - flown[c][-1] for c in "xyz"]),
                               0.5 * 9.81 * (1 - 1 / 1.2), delta=0.3)

    def test_replay_of_arrays_is_that_of_the_log(self):
        flown = trueline.replay(self.rotors, self.rotor_log, start=5.0, seconds=1.0)
        rotors = self.rotor_log.rotors
        speeds = np.column_stack([rotors[name] for name in rotors.dtype.names])
        again = trueline.replay(self.rotors, speeds, state=flown[0], t=flown.t)
        for name in trueline.STATE.names:
            np.testing.assert_allclose(again[name], flown[name], rtol=0, atol=1e-9)
        with self.assertRaisesRegex(trueline.InputError, "column for each of 4 rotors"):
            trueline.replay(self.rotors, speeds[:, :4], state=flown[0], t=flown.t)

    def test_score_measures_known_errors(self):
        a = np.zeros(3, trueline.STATE)
        a["t"], a["qw"] = [0.0, 0.1, 0.2], 1.0
        b = a.copy()
        b["x"], b["vy"], b["wz"] = 3.0, 4.0, 0.5
        b["qw"], b["qx"] = -np.cos(0.05), -np.sin(0.05)  # 0.1 rad, with the other sign
        errors, mean = trueline.score(b.view(np.recarray), a.view(np.recarray))
        np.testing.assert_allclose([mean.p, mean.v, mean.R, mean.w], [3.0, 4.0, 0.1, 0.5], rtol=1e-9)
        self.assertEqual(len(errors), 3)

    def test_a_model_is_exported_and_audited(self):
        file = trueline.export(self.rotors, to="gz", out=self.work / "vehicle.sdf")
        audit = trueline.audit(file, report=False)
        self.assertEqual(audit.contradicted, [])
        before = trueline.replay(self.rotors, self.rotor_log, start=2.0, seconds=0.3)
        after = trueline.replay(file, self.rotor_log, start=2.0, seconds=0.3)
        self.assertLess(np.linalg.norm([before[c][-1] - after[c][-1] for c in "xyz"]), 0.05)

    def test_diagnosis_and_design(self):
        found = trueline.diagnose(self.log, report=False, out=self.work / "diagnosis")
        command("diagnose", log=self.log.folder, out=self.work / "diagnosis_programs", report="false")
        self.assertEqual(found.verdict, trueline.Result(self.work / "diagnosis_programs").verdict)
        self.assertEqual(found.causes, trueline.Result(self.work / "diagnosis_programs").causes)
        flight = trueline.design(CONFIG / "design/quick.yaml", report=False, threads=1)
        self.assertGreater(len(flight.trajectory), 100)

    def test_functions_are_typed_and_documented(self):
        for name in trueline.__all__:
            thing = getattr(trueline, name)
            self.assertTrue(name in ("STATE", "__version__") or inspect.getdoc(thing), name)
        for verb in ("convert", "inspect", "calibrate", "diagnose", "audit", "simulate", "design"):
            function = getattr(trueline, verb)
            self.assertEqual(set(typing.get_type_hints(function)),
                             {*inspect.signature(function).parameters, "return"})
            helped = subprocess.run([BUILD / f"apps/trueline-{verb}", "--help"], capture_output=True,
                                    text=True, check=True).stdout
            for flag in inspect.signature(function).parameters:
                self.assertIn(f"--{flag.rstrip('_')} ", helped)
        self.assertTrue((BUILD / "python/trueline/py.typed").exists())


if __name__ == "__main__":
    unittest.main()
