"""The result folder of trueline calibrate."""
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from csv_table import empty_table, read_table
from errors import ReportError
from yaml_file import read_mapping

RUN = ["gamma", "tau"]
TABLES = {  # name: (columns of numbers, columns of text)
    "arcs": (RUN + ["t_start", "t_end", "final_point_error", "predicted_sigma", "iterations",
                    "solve_time", "inside_95", "x_predicted", "y_predicted", "x_truth", "y_truth",
                    "cov_xx", "cov_xy", "cov_yy"], ["estimator", "truth"]),
    "trajectory": (["t", "tau", "x", "y"], ["estimator", "kind"]),
    "windows": (RUN + ["t_start", "t_end", "value", "sigma"],
                ["estimator", "parameter", "unit", "status"]),
    "residuals": (RUN + ["t", "gate", "r_x", "r_y", "r_z", "sigma", "weight"], ["estimator"]),
}


@dataclass
class CalibrationResult:
    summary: dict              # calibration.yaml
    arcs: pd.DataFrame         # one row an arc, estimator and gamma
    trajectory: pd.DataFrame   # states by time: fitted passes and predicted arcs
    windows: pd.DataFrame      # one row a parameter, window, estimator and gamma
    residuals: pd.DataFrame    # one row a fix, window, estimator and gamma

    @property
    def verdict(self):
        return self.summary["verdict"]

    @property
    def estimator(self):
        """The estimator that the parameters in calibration.yaml come from."""
        return str(self.summary.get("estimator", "vgd"))

    @property
    def gamma(self):
        """Its window length, in passes."""
        return int(self.summary.get("gamma", 3))

    def headline_rows(self, table):
        """The rows of the headline's estimator and gamma."""
        rows = table[table.estimator == self.estimator]
        return rows[rows.gamma == self.gamma]


def read_calibration(directory):
    """Raises ReportError for a missing or damaged file. A flight without a usable result may lack
    the tables; they are empty then."""
    directory = Path(directory)
    path = directory / "calibration.yaml"
    summary = read_mapping(path)
    if summary.get("verdict") not in ("usable", "poor", "unusable"):
        raise ReportError(f"{path}: 'verdict' is {summary.get('verdict')!r}; expected usable, "
                          "poor or unusable")
    tables = {}
    for name, (numbers, texts) in TABLES.items():
        file = directory / f"{name}.csv"
        if summary["verdict"] == "unusable" and not file.exists():
            tables[name] = empty_table(numbers, texts)
        else:
            tables[name] = read_table(file, numbers, texts)
    return CalibrationResult(summary, **_since_start(tables))


def _since_start(tables):
    """Times from the first fitted fix on: stamps may count from 1970."""
    start = tables["residuals"].t.min()
    if pd.notna(start):
        for table in tables.values():
            for column in table.columns.intersection(["t", "t_start", "t_end"]):
                table[column] -= start
    return tables
