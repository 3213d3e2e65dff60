"""A part of scripts/blind/labelled.py: flights whose cause is known, by the real command."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
DATA = Path(os.environ.get("TRUELINE_DATA", SOURCE.parent / "shared/data")) / "labelled"
CRAZYPAD = DATA / "crazypad"


def flights(kind, vehicle, label):
    """The files of a label, in the order of their logs."""
    with (CRAZYPAD / "labels.csv").open() as file:
        rows = [line.split(",") for line in file]
    found = sorted((row[3], row[0]) for row in rows if row[1:3] == [kind, vehicle] and row[4] == label)
    return [CRAZYPAD / name for _, name in found]


class LabelledFlights(unittest.TestCase):
    def setUp(self):
        if not CRAZYPAD.is_dir():
            self.skipTest(f"{CRAZYPAD} is missing; set TRUELINE_DATA")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = Path(folder.name)

    def diagnose(self, log, against, *more):
        run = subprocess.run([BUILD / "apps/trueline-diagnose", f"--log={log}", f"--out={self.out / 'result'}",
                              "--against=" + ",".join(map(str, against)), "--quiet", *more],
                             capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        return yaml.safe_load((self.out / "result/diagnosis.yaml").read_text())

    def test_names_the_cut_propeller_with_the_load_that_is_alike(self):
        normal = flights("motor", "E8", "normal_flight")
        result = self.diagnose(flights("motor", "E8", "cut_propeller_M3_3mm_3mm_41mm")[0], normal)
        self.assertEqual([c["id"] for c in result["causes"]], ["rotor_loss"])
        self.assertEqual(result["causes"][0]["parameters"]["rotor"]["value"], 2)  # M3, from 0
        self.assertIn("payload", result["causes"][0]["confused_with"])
        self.assertEqual(len(result["against"]), 3)
        self.assertIn("plot-trims", (self.out / "result/report.html").read_text())

    def test_mixes_the_commands_of_controller_logs(self):
        cut = flights("controller", "E8", "cut_propeller_M3_3mm_3mm_41mm")[0]
        result = self.diagnose(cut, flights("motor", "E8", "normal_flight"), "--report=false")
        self.assertEqual([c["parameters"]["rotor"]["value"] for c in result["causes"]], [2])

    def test_is_silent_on_another_session_and_tape(self):
        *others, last = flights("motor", "E8", "normal_flight")
        tape = flights("motor", "E8", "tape_on_propeller_M3")[0]
        for log, against in ((last, others), (tape, [*others, last])):
            result = self.diagnose(log, against, "--report=false")
            self.assertEqual(result["causes"], [], log)

    def test_a_slow_position_sensor_bends_no_trim(self):
        fleet = DATA / "crazyswarm_thrust"
        rows = [line.split(",") for line in (fleet / "labels.csv").read_text().splitlines()]
        log, *others = [fleet / r[0] for r in rows if r[1] in ("log147", "log160", "log168", "log180")]
        result = self.diagnose(log, others, "--report=false")
        self.assertEqual((result["verdict"], "log_faults" in result), ("clean", False))
        self.assertIn("repeats", " ".join(result["warnings"]))

    def test_names_the_thrust_scale_of_upgraded_motors(self):
        fleet = DATA / "crazyswarm_thrust"
        rows = [line.split(",") for line in (fleet / "labels.csv").read_text().splitlines()]
        standard = [fleet / r[0] for r in rows if r[1] in ("log147", "log160", "log168", "log180")]
        upgraded = next(fleet / r[0] for r in rows if r[1] == "log133")
        result = self.diagnose(upgraded, standard, "--report=false")
        self.assertEqual([c["id"] for c in result["causes"]], ["thrust_scale"])
        self.assertGreater(result["causes"][0]["parameters"]["s"]["value"], 0.1)


if __name__ == "__main__":
    sys.exit(unittest.main())
