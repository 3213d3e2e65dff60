"""A table that another program wrote, given to trueline-calibrate as it is: result and page."""
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import pandas as pd

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
APPS = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build")) / "apps"


def stream(log, name):
    table = pd.read_csv(log / f"{name}.csv")
    return table.rename(columns={column: column.split(" ")[0] for column in table.columns})


class Table(unittest.TestCase):
    def test_calibrate_reads_it_and_draws_its_page(self):
        with tempfile.TemporaryDirectory(prefix="trueline_table_") as folder:
            root = Path(folder)
            log, table, out = root / "log", root / "flight.csv", root / "out"
            subprocess.run([APPS / "trueline-simulate", f"--config={SOURCE}/config/simulate/hippodrome.yaml",
                            f"--out={log}", "--quiet"], check=True)
            rows = pd.merge_asof(stream(log, "imu"), stream(log, "attitude"), on="t", direction="nearest")
            mocap = stream(log, "mocap")[["t", "x", "y", "z"]]
            rows = pd.merge_asof(rows, mocap, on="t", direction="nearest")
            rows.to_csv(table, index=False)
            outcome = subprocess.run([APPS / "trueline-calibrate", f"--log={table}", f"--out={out}"],
                                     capture_output=True, text=True)
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            self.assertIn("verdict:", outcome.stdout)
            self.assertGreater((out / "report.html").stat().st_size, 1e5)


if __name__ == "__main__":
        unittest.main()
