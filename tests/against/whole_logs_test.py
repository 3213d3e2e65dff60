"""trueline-diagnose --against on whole logs that are wrong: the first look of a plain diagnosis, on made flights."""
import csv
import os
import random
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])
SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])


def turn_fixes(log):
    """Turns the fixes by 90 degrees about the vertical."""
    with open(log / "fixes.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    x, y = (next(i for i, name in enumerate(rows[0]) if name.split()[0] == axis) for axis in ("x", "y"))
    for row in rows[1:]:
        row[x], row[y] = str(-float(row[y])), row[x]
    with open(log / "fixes.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)


def hover(log, seed, weak_speed=1.0):
    """A log of positions and rotor speeds alone, 20 s at rest in the air; the third rotor turns faster."""
    noise = random.Random(seed)
    log.mkdir(parents=True)
    (log / "log.yaml").write_text(f"name: {log.name}\nframe: NED\nbody: FRD\n")
    with open(log / "fixes.csv", "w", encoding="utf-8") as fixes, open(log / "rotors.csv", "w", encoding="utf-8") as rotors:
        fixes.write("t [s],x [m],y [m],z [m],sigma [m],gate [1]\n")
        rotors.write("t [s],w1 [rad/s],w2 [rad/s],w3 [rad/s],w4 [rad/s]\n")
        for i in range(1000):
            place = ",".join(f"{noise.gauss(0, 0.01) - height:.5f}" for height in (0, 0, 1))
            speeds = ",".join(f"{noise.gauss(700, 5) * (weak_speed if k == 2 else 1):.3f}" for k in range(4))
            fixes.write(f"{0.02 * i:.9f},{place},0.01,0\n")
            rotors.write(f"{0.02 * i:.9f},{speeds}\n")
    return log


class WholeLogs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = tempfile.TemporaryDirectory(prefix="trueline against ")
        cls.addClassCleanup(cls.made.cleanup)
        for seed in (1, 2, 3):
            subprocess.run([BUILD / "apps/trueline-simulate", f"--config={SOURCE / 'config/simulate/fast.yaml'}",
                            f"--out={Path(cls.made.name) / f'flight{seed}'}", f"--seed={seed}", "--quiet"], check=True)

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="trueline against ")
        self.addCleanup(folder.cleanup)
        self.out = Path(folder.name)

    def log(self, seed, folder="."):
        """A copy of a made flight."""
        path = self.out / folder / f"flight{seed}"
        shutil.copytree(Path(self.made.name) / path.name, path)
        return path

    def diagnose(self, log, *against, more=()):
        run = subprocess.run([BUILD / "apps/trueline-diagnose", f"--log={log}", f"--out={self.out / 'result'}",
                              "--against=" + ",".join(map(str, against)), "--report=false", *more],
                             capture_output=True, text=True, check=False)
        result = self.out / "result/diagnosis.yaml"
        return run, yaml.safe_load(result.read_text()) if result.exists() else None

    def test_a_fatal_fault_of_the_flight_explains_nothing(self):
        flight, reference = self.log(1), self.log(2)
        turn_fixes(flight)
        run, result = self.diagnose(flight, reference)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(result["verdict"], "unexplained")
        self.assertIn("position_axes", " ".join(result["log_faults"]))

    def test_a_wrong_reference_is_left_out_and_the_flight_itself_too(self):
        day = self.log(1, "day").parent
        turn_fixes(self.log(2, "day"))
        self.log(3, "day")
        run, result = self.diagnose(day / "flight1", day)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(result["against"], [str(day / "flight3")])
        self.assertIn(f"{day / 'flight2'}: has a fatal fault and is left out; correct it", result["warnings"])
        self.assertNotIn("log_faults", result)

    def test_no_reference_is_left(self):
        flight, reference = self.log(1), self.log(2)
        turn_fixes(reference)
        run, result = self.diagnose(flight, reference)
        self.assertEqual((run.returncode, result), (3, None))
        self.assertIn("every reference has a fatal fault", run.stderr)
        run, _ = self.diagnose(flight, flight)
        self.assertEqual(run.returncode, 2)
        self.assertIn("names no flight but the one in --log", run.stderr)

    def test_rotor_speeds_without_an_imu(self):
        weak, *others = (hover(self.out / f"hover{seed}", seed, 1.2 if seed == 0 else 1.0) for seed in range(4))
        run, result = self.diagnose(weak, *others)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual([cause["column"] for cause in result["causes"]], ["w3"])
        # A fleet whose flights scatter by more shows no weak rotor.
        run, result = self.diagnose(weak, *others, more=["--usual_scatter=0.1,0.1,0.1,0.2"])
        self.assertEqual((run.returncode, result["causes"]), (0, []), run.stderr)
        run, _ = self.diagnose(weak, *others, more=["--usual_scatter=0.1,0.1,0.1"])
        self.assertEqual(run.returncode, 2)
        self.assertIn("--usual_scatter=0.1,0.1,0.1: write four positive numbers", run.stderr)

    def test_a_copy_of_the_flight_is_refused(self):
        run, _ = self.diagnose(self.log(1), self.log(1, "copy"))
        self.assertEqual(run.returncode, 2)
        self.assertIn("is the same recording as", run.stderr)


if __name__ == "__main__":
    sys.exit(unittest.main())
