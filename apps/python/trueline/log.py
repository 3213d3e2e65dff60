"""A flight's log, from a folder or from arrays."""
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy as np

from . import _trueline
from .result import Array, Record, Table, read_yaml, write_yaml
from .run import Scratch

Stream = Union[Array, Mapping[str, Any]]


def _rows(stream: Stream) -> Array:
    """Samples x columns, in the order in which the columns are given."""
    if isinstance(stream, Mapping):
        return np.column_stack([np.asarray(column, float) for column in stream.values()])
    names = stream.dtype.names
    return np.column_stack([stream[name] for name in names]) if names else np.asarray(stream, float)


class Log:
    """A native log: SI units, NED earth axes E, forward-right-down body axes.

        Log("logs/flight")
        Log(imu=imu, fixes=fixes, gravity=9.81, vehicle={"mass": 0.4})

    A stream is an array of samples x columns, a structured array, or a mapping of columns, in the
    native log's order: the time t (s), then the numbers (problems/log/README.md). Other arguments
    are keys of log.yaml. Arrays are written as a native log, in a temporary folder that lasts as
    long as this object; times are rounded to 1 ns. Reading gives structured arrays:
    `log.imu["ax"]`. Raises `InputError` for what no log can have.
    """

    exit_code: int = 0  # of the run that made it
    warned: List[str] = []

    def __init__(self, folder: Optional[Union[str, os.PathLike[str]]] = None, **given: Any):
        self.folder = Path(folder) if folder is not None else self._write(given)
        if folder is not None and given:
            raise TypeError("give either a folder, or streams and keys")
        self._streams: Optional[Dict[str, Table]] = None

    def _write(self, given: Dict[str, Any]) -> Path:
        arrays = {name: np.ascontiguousarray(_rows(value)) for name, value in given.items()
                  if isinstance(value, np.ndarray) or name in _trueline.streams}
        about = {name: value for name, value in given.items() if name not in arrays}
        self._keep = Scratch()
        folder = Path(self._keep.name) / "log"
        folder.mkdir()
        head = {"name": "arrays", "frame": "NED", "body": "FRD", **about}
        write_yaml(folder / "log.yaml", head)
        _trueline.write_streams(str(folder), arrays)
        return folder

    def __fspath__(self) -> str:
        return str(self.folder)

    @property
    def streams(self) -> Dict[str, Table]:
        """The streams by name, as structured arrays."""
        if self._streams is None:
            self._streams = {
                name: np.rec.fromarrays(list(rows.T), dtype=[(column, float) for column in columns])
                for name, (columns, rows) in _trueline.read_log(str(self.folder)).items()}
        return self._streams

    @property
    def about(self) -> Record:
        """log.yaml."""
        return read_yaml(self.folder / "log.yaml")

    @property
    def truth(self) -> Record:
        """Of a simulated flight: its true parameters, errors and effects."""
        return read_yaml(self.folder.with_name(self.folder.name + ".truth.yaml"))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "folder":
            raise AttributeError(name)
        if name in self.streams:
            return self.streams[name]
        raise AttributeError(f"the log has no stream '{name}', but {', '.join(self.streams)}")

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self.streams]

    def __repr__(self) -> str:
        return f"<Log {self.folder}>"
