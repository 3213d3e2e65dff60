"""A result folder as an object."""
import html
import os
import re
import webbrowser
from pathlib import Path
from typing import Any, Dict, List, Mapping, Union

import numpy as np
import pandas as pd
import yaml


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Reads 5e-07 as a number, as YAML 1.2 has it."""


_Loader.add_implicit_resolver("tag:yaml.org,2002:float", re.compile(r"^[-+]?\d+[eE][-+]?\d+$"),
                              list("-+0123456789"))


Array = np.ndarray[Any, Any]
Table = np.recarray[Any, Any]


class Record(Dict[str, Any]):
    """A mapping of a YAML file: `record.K_x.value` is `record["K_x"]["value"]`."""

    def __getattr__(self, name: str) -> Any:
        if name in self:
            return self[name]
        raise AttributeError(f"'{name}' is none of {', '.join(map(str, self))}")

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *map(str, self)]


def _as_records(node: Any) -> Any:
    if isinstance(node, dict):
        return Record({key: _as_records(value) for key, value in node.items()})
    return [_as_records(value) for value in node] if isinstance(node, list) else node


def read_yaml(path: Path) -> Record:
    """The file's mapping; a list is under `items`."""
    node = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    record: Record = _as_records(node if isinstance(node, dict) else {"items": node})
    return record


def _as_plain(node: Any) -> Any:
    if isinstance(node, Mapping):
        return {key: _as_plain(value) for key, value in node.items()}
    if isinstance(node, (list, tuple, np.ndarray)):
        return [_as_plain(value) for value in node]
    return node.item() if isinstance(node, np.generic) else node


def write_yaml(path: Path, mapping: Mapping[str, Any]) -> None:
    path.write_text(yaml.safe_dump(_as_plain(mapping), sort_keys=False), encoding="utf-8")


def read_table(path: Path) -> Table:
    """A CSV file with columns by name, without units: they are in `table.dtype[name].metadata`,
    under "unit"."""
    frame = pd.read_csv(path, skipinitialspace=True)
    heads = [re.match(r"\s*(\S+)\s*(?:\[(.*)\])?", column) for column in frame.columns]
    frame.columns = [head[1] if head else column for head, column in zip(heads, frame.columns)]
    plain = frame.to_records(index=False)
    kinds = [(name, np.dtype(plain.dtype[name].str, metadata={"unit": (head and head[2]) or ""}))
             for name, head in zip(frame.columns, heads)]
    table: Table = plain.astype(kinds).view(np.recarray)
    return table


class Page:
    """A report. A notebook shows it; `show()` opens it in the browser; `path` is the file."""

    def __init__(self, path: Path):
        self.path = path

    def __fspath__(self) -> str:
        return str(self.path)

    def show(self) -> bool:
        return webbrowser.open(self.path.resolve().as_uri())

    def _repr_html_(self) -> str:
        page = html.escape(self.path.read_text(encoding="utf-8"))
        return f'<iframe srcdoc="{page}" width="100%" height="800" frameborder="0"></iframe>'


class Result:
    """What a verb has written: the entries of its YAML file as attributes (`result.verdict`), its
    CSV files as NumPy record arrays (`result.trajectory`), its page (`result.plot()`).

    Opens an earlier result too: `Result("results/lap_1")`. `exit_code` and `warned` are those of
    the run that made it.
    """
    exit_code: int = 0
    warned: List[str] = []

    def __init__(self, folder: Union[str, os.PathLike[str]]):
        self.folder = Path(folder)
        # manifest.yaml and model.yaml stand beside the verb's own file, which has one of these names.
        own = [name for name in ("calibration", "diagnosis", "inspection", "audit", "score",
                                 "observability", "ranking", "summary")
               if (self.folder / f"{name}.yaml").exists()]
        if not own:
            raise FileNotFoundError(f"{self.folder}: holds no result of trueline")
        self.values = read_yaml(self.folder / f"{own[0]}.yaml")

    def __fspath__(self) -> str:
        return str(self.folder)

    @property
    def tables(self) -> List[str]:
        """The names of the CSV files."""
        return sorted(path.stem for path in self.folder.glob("*.csv"))

    def table(self, name: str) -> Table:
        """One of `tables`, also where an entry has its name: `arcs` of a calibration."""
        return read_table(self.folder / f"{name}.csv")

    @property
    def files(self) -> List[str]:
        return sorted(path.name for path in self.folder.iterdir())

    @property
    def model(self) -> Record:
        """model.yaml, the calibrated vehicle; the result itself goes as `model=` to other verbs."""
        return read_yaml(self.folder / "model.yaml")

    def plot(self) -> Page:
        """The report with all plots."""
        page = self.folder / "report.html"
        if not page.exists():
            raise FileNotFoundError(f"{page}: the verb ran with report=False")
        return Page(page)

    def __getattr__(self, name: str) -> Any:
        values: Record = self.__dict__.get("values", Record())
        if name in values:
            return values[name]
        if "folder" in self.__dict__ and name in self.tables:
            self.__dict__[name] = self.table(name)
            return self.__dict__[name]
        raise AttributeError(f"'{name}' is neither an entry ({', '.join(map(str, values))}) nor a "
                             f"table ({', '.join(self.tables)})")

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *map(str, self.values), *self.tables]

    def __repr__(self) -> str:
        verdict = self.values.get("verdict")
        return f"<Result {self.folder}{f': {verdict}' if isinstance(verdict, str) else ''}>"
