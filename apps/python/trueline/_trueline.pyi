"""The binding (apps/python/module.cc)."""
from typing import Any, Dict, List, Tuple

from .result import Array

class InputError(ValueError):
    """Bad input or usage; the text names the place and the remedy. Exit code 2."""

class NoUsableResult(InputError):
    """Good input that the asked result can't be made of. Exit code 3."""

version: str
verbs: List[str]
streams: List[str]  # that a log may have

def usage(verb: str) -> str: ...
def flags(verb: str) -> List[Tuple[str, Any, str]]: ...  # name, initial value, help
def run(verb: str, flags: Dict[str, Any]) -> Tuple[int, List[str]]: ...  # exit code, warnings
def find_shared(path: str) -> str: ...
def read_log(folder: str) -> Dict[str, Tuple[List[str], Array]]: ...
def write_streams(folder: str, streams: Dict[str, Array]) -> None: ...
def measured(folder: str, model: str) -> Tuple[Array, List[float], List[List[float]]]: ...
def replay(model: str, start: Array, times: List[float], speed_times: List[float], speeds: Array,
           commands: bool) -> Array: ...
def errors(predicted: Array, measured: Array) -> Array: ...
