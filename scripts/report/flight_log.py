"""What the pages show of a native log: its name, gates, fixes and mocap."""
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from csv_table import empty_table, read_table
from errors import ReportError
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
    return FlightLog(str(header.get("name", directory.name)), _gates(header, directory),
                     _read_stream(directory / "fixes.csv", FIX_COLUMNS),
                     _read_stream(directory / "mocap.csv", MOCAP_COLUMNS))


def _read_stream(path, columns):
    """A stream may be missing, and its last line may be cut off: that line is left out."""
    if not path.exists():
        return empty_table(columns)
    return read_table(path, columns, may_be_cut_off=True).dropna(subset=["t", "x", "y"])


def _gates(header, directory):
    gates = header.get("gates") or []
    for gate in gates:
        if not (isinstance(gate, dict) and "id" in gate and len(gate.get("position", [])) == 3):
            raise ReportError(f"{directory / 'log.yaml'}: a gate needs an id and a position of "
                              f"three numbers; found {gate}")
    return gates
