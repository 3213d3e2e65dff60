"""Runs a verb of the command line in this process."""
import os
import shutil
import tempfile
import warnings
import weakref
from pathlib import Path
from typing import Any, Callable, Dict, Mapping, Optional, Sequence, TypeVar, Union

from . import _trueline
from .result import write_yaml

Folder = Optional[Union[str, os.PathLike[str]]]
# Paths with commas between on the command line; a mapping is written as a YAML file.
Text = Union[str, os.PathLike[str], Sequence[Union[str, os.PathLike[str]]],
             Mapping[str, Any]]
Kind = TypeVar("Kind")


class TruelineWarning(UserWarning):
    """What the command line prints as a warning."""


def config(name: str) -> Path:
    """A configuration that ships, such as "simulate/hippodrome.yaml"."""
    return Path(_trueline.find_shared(f"config/{name}"))


class Scratch:
    """A temporary folder that goes with this object."""

    def __init__(self) -> None:
        self.name = tempfile.mkdtemp(prefix="trueline-")
        weakref.finalize(self, shutil.rmtree, self.name, ignore_errors=True)


def _text(flag: str, value: Any, folder: Path) -> str:
    if isinstance(value, Mapping):
        file = folder / f"{flag}.yaml"
        write_yaml(file, value)
        return str(file)
    if isinstance(value, (str, os.PathLike)):
        path = os.fspath(value)
        # A result stands for its model where a model is asked for.
        return os.path.join(path, "model.yaml") if flag == "model" and os.path.isdir(path) else path
    if isinstance(value, Sequence):
        return ",".join(_text(flag, part, folder) for part in value)
    raise TypeError(f"{flag}: a text, a path, a list of them or a mapping is needed, "
                    f"not {type(value).__name__}")


def run(verb: str, kind: Callable[[Any], Kind], arguments: Dict[str, Any]) -> Kind:
    """The folder (or file) that the verb writes, as a `kind`. Without `out` that is a temporary
    folder, which lasts as long as the returned object."""
    keep = Scratch()
    given = {name.rstrip("_"): value for name, value in arguments.items()}
    if given["out"] is None and kind is Path:
        raise TypeError("out: the file to write is needed")
    if given["out"] is None:
        given["out"] = Path(keep.name) / verb
    initial = {flag: value for flag, value, _ in _trueline.flags(verb)}
    for flag, value in given.items():
        if isinstance(initial[flag], str):
            given[flag] = _text(flag, value, Path(keep.name))
        elif type(value) is not type(initial[flag]) and not (
                isinstance(initial[flag], float) and type(value) is int):
            raise TypeError(f"{flag}: {type(initial[flag]).__name__} is needed, not {value!r}")
    code, said = _trueline.run(verb, given)
    for text in said:
        warnings.warn(text, TruelineWarning, stacklevel=3)
    made = kind(given["out"])
    if not isinstance(made, Path):
        made.__dict__.update(exit_code=code, warned=said, _keep=keep)
    return made
