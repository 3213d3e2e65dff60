#!/usr/bin/python3
"""Blind tests that were killed go on where they stopped, and never on the results of another draw or
program. On a made flight of the course `figure_eight`."""
import os
import tempfile
import unittest
from pathlib import Path

import in_process

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])


def run(script, *flags):
    return in_process.run(SOURCE / "scripts" / script, f"--build={BUILD}", *flags)


class Resume(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="trueline resume ")  # paths may have spaces
        self.addCleanup(folder.cleanup)
        self.work = Path(folder.name) / "work"

    def check_refuses_another(self, script, flags, other):
        """`other`: flags of another draw."""
        refused = run(script, *other)
        self.assertEqual(refused.returncode, 1, refused.stderr)
        self.assertIn(f"{self.work} holds results of", refused.stderr)
        (self.work / "program.sha256").write_text("that of another program")
        refused = run(script, *flags)
        self.assertEqual(refused.returncode, 1, refused.stderr)
        self.assertIn("of another program; give another folder", refused.stderr)


class Faults(Resume):
    def faults(self, *more):
        return run("blind/faults.py", f"--work={self.work}", "--flights=sim_figure_eight", "--faults=scale,late",
                   *(more or ["--seed=3"]))

    def test_goes_on_after_a_kill(self):
        (self.work / "base/sim_figure_eight").mkdir(parents=True)
        (self.work / "base/sim_figure_eight/imu.csv").write_text("t [s]\n")  # of a simulation that was killed
        whole = self.faults()
        self.assertEqual(whole.returncode, 0, whole.stderr)
        self.assertIn("| scale | 1 | 1 |", whole.stdout)
        trial = self.work / "trials/sim_figure_eight"
        written = (trial / "late/inspection.yaml").stat().st_mtime_ns
        self.assertFalse((trial / "late/log").exists())
        # Killed between the inspection and the repair of one trial; the other is done.
        (trial / "scale/outcome.yaml").unlink()
        (trial / "scale/log").mkdir()
        again = self.faults()
        self.assertEqual((again.returncode, again.stderr), (0, ""))
        self.assertEqual(again.stdout, whole.stdout)
        self.assertEqual((trial / "late/inspection.yaml").stat().st_mtime_ns, written)
        self.check_refuses_another("blind/faults.py", [f"--work={self.work}", "--seed=3"],
                                   [f"--work={self.work}", "--seed=4"])


class Terms(Resume):
    def test_refuses_another_draw_and_program(self):
        flags = [f"--work={self.work}", "--flights=0", "--seed=3"]
        first = run("blind/terms.py", *flags)
        self.assertEqual(first.returncode, 0, first.stderr)
        self.check_refuses_another("blind/terms.py", flags, [*flags, "--drive=rotors"])


class Coverage(Resume):
    def test_refuses_another_draw_and_program(self):
        flags = [f"--out={self.work}", "--flights=0", "--config=config/simulate/fast.yaml"]
        first = run("coverage.py", *flags)
        self.assertEqual(first.returncode, 0, first.stderr)
        self.check_refuses_another("coverage.py", flags, [*flags, "--set=ahrs.tilt_gain=0.02"])

    def test_another_text_of_the_configuration_is_another_draw(self):
        config = self.work.parent / "fast.yaml"
        config.write_text((SOURCE / "config/simulate/fast.yaml").read_text())
        flags = [f"--out={self.work}", "--flights=0", f"--config={config}"]
        self.assertEqual(run("coverage.py", *flags).returncode, 0)
        config.write_text(config.read_text() + "# changed\n")
        self.assertIn("holds results of", run("coverage.py", *flags).stderr)


if __name__ == "__main__":
    unittest.main()
