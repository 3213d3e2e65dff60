#!/usr/bin/python3
"""Blind tests never go on with the results of another draw or
program."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])


def run(script, *flags):
    return subprocess.run([sys.executable, "-B", SOURCE / "scripts" / script, f"--build={BUILD}", *flags],
                          capture_output=True, text=True, check=False)


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
