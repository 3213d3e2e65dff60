"""What the pages show of a native log: its name, gates, fixes and mocap."""
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from csv_table import empty_table, read_table
from yaml_file import read_mapping

FIX_COLUMNS = ["t", "x", "y", "z", "sigma", "gate"]
MOCAP_COLUMNS = ["t", "x", "y", "z"]


@dataclass
class FlightLog:
    name: str
    gates: list            # of {id, position (m, NED), yaw (rad)}
    fixes: pd.DataFrame    # t (s), x, y, z, sigma (m), gate
    mocap: pd.DataFrame    # t (s), x, y, z (m)


def read_log(directory):
    """Raises ReportError where log.yaml is missing or a stream is damaged."""
    directory = Path(directory)
    header = read_mapping(directory / "log.yaml", "--log must be a native log's folder")
    return FlightLog(str(header.get("name", directory.name)), header.get("gates") or [],
                     _read_stream(directory / "fixes.csv", FIX_COLUMNS),
                     _read_stream(directory / "mocap.csv", MOCAP_COLUMNS))


def _read_stream(path, columns):
    """A stream may be missing, and its last line may be cut off: that line is left out."""
    if not path.exists():
        return empty_table(columns)
    return read_table(path, columns).dropna(subset=["t", "x", "y"])
