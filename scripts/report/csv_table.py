"""Reading of CSV files whose columns are named `name [unit]`."""
import csv
import re

import pandas as pd

from errors import ReportError

# Units that a native log may use instead of SI, as factors.
FACTORS = {"cm": 0.01, "mm": 0.001, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
HEADER = re.compile(r"^\s*(?P<name>\S+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*$")


def read_table(path, numbers, texts=(), remedy="give the folder of a finished run", may_be_cut_off=False):
    """A data frame with the columns `numbers` (float, NaN where the field is empty) and `texts`.

    Columns may stand in any order; others are ignored. With `may_be_cut_off` a last line without
    its line break is left out. Raises ReportError naming file and column or line.
    """
    try:
        names, units = _read_header(path)
        for name in [*numbers, *texts]:
            if names.count(name) != 1:
                raise ReportError(f"{path}:1: column '{name}' is "
                                  f"{'stated twice' if name in names else 'missing'}; found: "
                                  f"{', '.join(names)}")
        lines = _count_whole_lines(path) - 1 if may_be_cut_off else None
        frame = _read_columns(path, names, numbers, texts, lines)
    except FileNotFoundError as error:
        raise ReportError(f"{path}: no such file; {remedy}") from error
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as error:
        raise ReportError(f"{path}: {str(error).strip()}") from error
    for name in numbers:
        frame[name] *= FACTORS.get(units[name], 1.0)
    frame[list(texts)] = frame[list(texts)].fillna("")
    return frame


def empty_table(numbers, texts=()):
    return pd.DataFrame({**{name: pd.Series(dtype=str) for name in texts},
                         **{name: pd.Series(dtype=float) for name in numbers}})


def _read_header(path):
    """Names in order, and name -> unit."""
    with open(path, encoding="utf-8-sig") as stream:
        line = stream.readline().strip()
    if not line:
        raise ReportError(f"{path}:1: empty; expected a header line")
    matches = [HEADER.match(field) for field in next(csv.reader([line]))]
    names = [m["name"] if m else f"unreadable_{i}" for i, m in enumerate(matches)]
    return names, {m["name"]: m["unit"] for m in matches if m}


def _count_whole_lines(path):
    with open(path, "rb") as stream:
        return sum(block.count(b"\n") for block in iter(lambda: stream.read(1 << 20), b""))


def _read_columns(path, names, numbers, texts, lines):
    options = dict(header=None, skiprows=1, names=names, index_col=False, nrows=lines,
                   usecols=[*numbers, *texts], skipinitialspace=True, skip_blank_lines=False)
    kinds = {**dict.fromkeys(numbers, float), **dict.fromkeys(texts, str)}
    try:
        return pd.read_csv(path, dtype=kinds, **options).dropna(how="all")
    except ValueError as error:
        if isinstance(error, (pd.errors.ParserError, UnicodeDecodeError)):
            raise
        text = pd.read_csv(path, dtype=str, **options)
        raise _first_wrong_number(path, text[list(numbers)]) from error


def _first_wrong_number(path, text):
    """The error for a column that pandas could not read as numbers."""
    numbers = text.apply(pd.to_numeric, errors="coerce")
    wrong = (numbers.isna() & text.notna()).to_numpy()
    row, column = divmod(int(wrong.argmax()), wrong.shape[1])
    return ReportError(f"{path}:{row + 2}: '{text.iloc[row, column]}' in column "
                       f"'{text.columns[column]}' is not a number")
