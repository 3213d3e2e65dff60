#!/usr/bin/python3
"""scripts/flights: tables of flights that can and can't be used, and the merge of few results."""
import os
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "scripts/flights"))

import in_process
from fleet import earlier_flights, link_sessions, read_flights

ESTIMATE = {"K_x": {"value": -0.5, "sigma": 0.02, "unit": "1/s", "status": "identified"}}
STATUS = {"code": 0, "message": "", "cpu_seconds": 1.0, "memory_mb": 50}


def run(script, *flags):
    return in_process.run(SOURCE / "scripts/flights" / script, *flags)


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


class Earlier(InFolder):
    def test_are_of_the_vehicle_and_before_in_a_folder_for_each_day(self):
        self.write("c,quad,2024-03-03,logs/c", "a,quad,2024-03-01T08:00:00Z,logs/a", "x,other,2024-03-01,logs/x",
                   "b,quad,2024-03-01T09:00:00Z,logs/b", "d,quad,2024-03-04,logs/d")
        earlier = earlier_flights(read_flights(self.table), 2)
        self.assertEqual({name: [f.flight for f in before] for name, before in earlier.items()},
                         {"a": [], "b": ["a"], "c": ["a", "b"], "d": ["b", "c"], "x": []})
        folders = link_sessions(self.out / "earlier", earlier["d"], lambda flight: flight.log)
        self.assertEqual(folders, f"{self.out}/earlier/2024-03-01,{self.out}/earlier/2024-03-03")
        self.assertEqual((self.out / "earlier/2024-03-03/c").readlink(), Path("logs/c").resolve())


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

    def compare(self, name, trims, **result):
        """What --against wrote for a flight; `trims`: u1 by flight, that under judgement first."""
        folder = self.out / "against" / name
        folder.mkdir(parents=True)
        against = [f"earlier/{flight}" for flight in list(trims)[1:]]
        (folder / "diagnosis.yaml").write_text(yaml.safe_dump({"causes": [], "against": against, **result}))
        rows = [f"earlier/{flight},0,20,3.7,{u},0.001,0" for flight, u in trims.items()]
        (folder / "trims.csv").write_text("\n".join(
            ["log,session [1],steady [s],battery [V],u1 [1],sigma_u1 [1],saturated_u1 [1]", *rows]) + "\n")

    def test_the_first_flight_that_differs_and_why(self):
        weak = {"id": "rotor_loss", "text": "u1 gives 20 % less thrust", "parameters": {}}
        drag = {"id": "rotor_drag", "parameters": {"k": {"value": 0.03, "sigma": 0.01, "unit": "s/m"}}}
        self.compare("b", {"b": 0.5, "a": 0.51}, drive="commands", verdict="clean")
        self.compare("c", {"c": 0.6, "b": 0.5, "a": 0.51}, drive="commands", verdict="ambiguous", causes=[weak, weak])
        self.compare("d", {"d": 0.6, "c": 0.6}, verdict="explained", causes=[drag])
        _, page = self.merge({name: ESTIMATE for name in "abcd"})
        history = yaml.safe_load((self.out / "history.yaml").read_text())["quad"]
        self.assertEqual(history["first_change"], {"flight": "c", "date": "2024-03-01", "session": 1,
                                                   "why": "u1 gives 20 % less thrust"})
        self.assertEqual([f["outcome"] for f in history["flights"]],
                         ["not compared", "alike", "differs", "differs"])
        self.assertEqual(history["flights"][3]["why"], "rotor_drag: k = 0.03 +- 0.01 s/m")
        self.assertEqual(history["flights"][0]["trim"], {"u1": {"value": 0.51, "sigma": 0.001}})
        self.assertIn("What has changed, and when", page)
        self.assertIn("trim u1", page)

    def test_a_change_that_no_cause_explains_and_a_wrong_log(self):
        self.compare("b", {"b": 0.5, "a": 0.51}, drive="commands", verdict="unexplained")
        self.compare("c", {"c": 0.5, "a": 0.51}, verdict="unexplained", trim={"verdict": "clean"})
        self.compare("d", {"d": 0.5, "a": 0.51}, verdict="unexplained", log_faults=["position_axes: turned"],
                     causes=[{"id": "fix_latency", "parameters": {}}])
        self.merge({name: ESTIMATE for name in "abcd"})
        flights = yaml.safe_load((self.out / "history.yaml").read_text())["quad"]["flights"]
        self.assertEqual([f["outcome"] for f in flights], ["not compared", "differs", "alike", "wrong log"])
        self.assertEqual(flights[3]["why"], "position_axes: turned")

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
