"""Reading of what trueline benchmark writes."""
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

import charts
from csv_table import empty_table, read_table
from yaml_file import read_mapping

HEADLINE_GAMMA = 3  # of the paper's comparison (figs. 12 and 13)


@dataclass
class Benchmark:
    summary: dict
    arcs: pd.DataFrame         # one row an arc, label and gamma; only arcs that count
    all_arcs: pd.DataFrame     # those without truth, too
    convergence: pd.DataFrame
    paths: pd.DataFrame        # of the first flight: positions and velocities by time
    estimates: pd.DataFrame    # of the first flight: one row a parameter, window and label

    @property
    def labels(self):
        return list(dict.fromkeys(self.all_arcs.label))

    @property
    def logs(self):
        return list(dict.fromkeys(self.all_arcs.log))

    @property
    def has_sweep(self):
        return self.all_arcs["sweep"].notna().any()

    def headline(self, label):
        """Arcs of a label at the headline's gamma, or the nearest that it has."""
        rows = self.arcs[self.arcs.label == label]
        if rows.empty:
            return rows
        gamma = min(rows.gamma.unique(), key=lambda g: abs(g - HEADLINE_GAMMA))
        return rows[rows.gamma == gamma]

    def estimator_of(self, label):
        """Empty for a label that predicted no arc: a flight of one pass has none."""
        rows = self.all_arcs[self.all_arcs.label == label]
        return rows.estimator.iloc[0] if len(rows) else ""

    def colour(self, label):
        """The estimator's own colour for its first label; other labels get one of the spare."""
        first = {}  # label of each estimator
        for other in self.labels:
            first.setdefault(self.estimator_of(other), other)
        estimator = self.estimator_of(label)
        if first.get(estimator, label) == label:
            return charts.colour(estimator)
        others = [other for other in self.labels if other not in first.values()]
        return charts.SPARE_COLOURS[others.index(label) % len(charts.SPARE_COLOURS)]


def read_benchmark(folder):
    folder = Path(folder)
    summary = read_mapping(folder / "summary.yaml")
    arcs = read_table(
        folder / "arcs.csv",
        numbers=["gamma", "tau", "t_start", "t_end", "final_point_error", "predicted_sigma",
                 "iterations", "solve_time", "sweep", "seed", "inside_95", "counted", "bound"],
        texts=["log", "estimator", "label", "truth"])
    counted = arcs[(arcs.counted == 1) & arcs.final_point_error.notna()]
    return Benchmark(
        summary, counted, arcs,
        _read_if_there(folder / "convergence.csv",
                       ["gamma", "sweep", "seed", "tolerance", "windows", "time"],
                       ["log", "label", "quantity"]),
        _read_if_there(folder / "trajectory.csv",
                       ["tau", "t", "x", "y", "z", "vx", "vy", "vz"], ["label", "kind"]),
        _read_if_there(folder / "estimates.csv", ["tau", "t", "value", "sigma", "truth"],
                       ["label", "name", "unit"]))


def _read_if_there(path, numbers, texts):
    return read_table(path, numbers, texts) if path.exists() else empty_table(numbers, texts)
