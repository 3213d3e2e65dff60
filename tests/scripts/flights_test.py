#!/usr/bin/python3
"""scripts/flights: tables of flights that can and can't be used, and the merge of few results."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

sys.dont_write_bytecode = True
SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "scripts/flights"))

from fleet import read_flights

ESTIMATE = {"K_x": {"value": -0.5, "sigma": 0.02, "unit": "1/s", "status": "identified"}}
STATUS = {"code": 0, "message": "", "cpu_seconds": 1.0, "memory_mb": 50}


def run(script, *flags):
    return subprocess.run([sys.executable, "-B", SOURCE / "scripts/flights" / script, *flags],
                          capture_output=True, text=True, check=False)


class InFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="trueline flights ")
        self.addCleanup(folder.cleanup)
        self.out = Path(folder.name)
        self.table = self.out / "flights.csv"

    def write(self, *rows, encoding="utf-8"):
        self.table.write_text("\n".join(["flight,vehicle,date,log", *rows]) + "\n", encoding=encoding)


class Table(InFolder):
    def test_reads_dates_and_times_and_a_spreadsheets_mark(self):
        self.write("a,quad,2024-03-01,logs/a", "b,quad,2024-03-01T16:20:00Z,logs/b", encoding="utf-8-sig")
        self.assertEqual([flight.flight for flight in read_flights(self.table)], ["a", "b"])

    def test_refuses_with_the_line(self):
        for row, words in (("b,quad,first of March,l", "2024-03-01"), ("a,quad,2024-03-01,l", "name of its own"),
                           ("b,,2024-03-01,l", "vehicle is missing")):
            self.write("a,quad,2024-03-01,logs/a", row)
            with self.assertRaises(SystemExit) as refused:
                read_flights(self.table)
            self.assertIn(f"{self.table}:3: ", str(refused.exception))
            self.assertIn(words, str(refused.exception))


class Merge(InFolder):
    def merge(self, results):
        """`results`: parameters by flight; None where the flight gave no result."""
        self.write(*(f"{name},quad,2024-03-01,logs/{name}" for name in results))
        for name, parameters in results.items():
            calibrated, status = self.out / "calibrate" / name, self.out / "status" / name
            calibrated.mkdir(parents=True)
            status.mkdir(parents=True)
            status = status / "calibrate.yaml"
            status.write_text(yaml.safe_dump({**STATUS, "code": 0 if parameters else 2, "message": "no fixes"}))
            if parameters:
                (calibrated / "calibration.yaml").write_text(
                    yaml.safe_dump({"verdict": "usable", "parameters": parameters}))
        merged = run("merge.py", f"--flights={self.table}", f"--out={self.out}")
        self.assertEqual(merged.returncode, 0, merged.stderr)
        return (self.out / "parameters.csv").read_text().splitlines(), (self.out / "report.html").read_text()

    def test_a_single_flight(self):
        parameters, page = self.merge({"a": ESTIMATE})
        self.assertEqual(parameters[1:], ["a,quad,2024-03-01,K_x,-0.5,0.02,1/s,identified"])
        self.assertIn("1 flights of 1 vehicles", page)

    def test_no_flight_has_a_result(self):
        parameters, page = self.merge({"a": None})
        self.assertEqual(len(parameters), 1)
        self.assertIn("calibrate: no fixes", page)


class Fleet(InFolder):
    def simulate(self, *flags):
        return run("simulate_fleet.py", f"--out={self.out}", "--flights=0", *flags)

    def test_refuses_the_folder_of_another_draw(self):
        self.assertEqual(self.simulate("--seed=1").returncode, 0)
        defects = (self.out / "defects.yaml").read_text()
        refused = self.simulate("--seed=2")
        self.assertEqual(refused.returncode, 1)
        self.assertIn(f"{self.out} holds results of", refused.stderr)
        self.assertEqual((self.out / "defects.yaml").read_text(), defects)

    def test_each_defect_needs_a_vehicle(self):
        self.assertIn("--vehicles: 3 or more", self.simulate("--vehicles=2").stderr)


if __name__ == "__main__":
    unittest.main()
