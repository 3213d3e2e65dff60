"""Reading of CSV files whose columns are named `name [unit]`."""
import re

import pandas as pd

from errors import ReportError

# Units that a native log may use instead of SI, as factors.
FACTORS = {"cm": 0.01, "mm": 0.001, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
HEADER = re.compile(r"^\s*(?P<name>\S+?)\s*(?:\[(?P<unit>[^\]]*)\])?\s*$")


def read_table(path, numbers, texts=(), remedy=""):
    """A data frame with the columns `numbers` (float, NaN where the field is empty) and `texts`.

    Columns may stand in any order; others are ignored. Raises ReportError naming file and column
    or line.
    """
    try:
        frame = pd.read_csv(path, dtype=str, keep_default_na=False, skipinitialspace=True)
    except FileNotFoundError as error:
        raise ReportError(f"{path}: no such file{'; ' + remedy if remedy else ''}") from error
    except pd.errors.EmptyDataError as error:
        raise ReportError(f"{path}: empty; expected a header line") from error
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as error:
        raise ReportError(f"{path}: {str(error).strip()}") from error

    headers = [HEADER.match(header) for header in frame.columns]
    units = {m["name"]: m["unit"] for m in headers if m}
    frame.columns = [m["name"] if m else header for m, header in zip(headers, frame.columns)]
    for name in [*numbers, *texts]:
        if name not in frame.columns:
            raise ReportError(f"{path}:1: column '{name}' is missing; found: "
                              f"{', '.join(frame.columns)}")
    columns = {name: frame[name].fillna("") for name in texts}
    for name in numbers:
        columns[name] = _to_numbers(path, name, frame[name]) * FACTORS.get(units[name], 1.0)
    return pd.DataFrame(columns)


def empty_table(numbers, texts=()):
    return pd.DataFrame({**{name: pd.Series(dtype=str) for name in texts},
                         **{name: pd.Series(dtype=float) for name in numbers}})


def _to_numbers(path, name, column):
    numbers = pd.to_numeric(column, errors="coerce")
    stated = ~column.fillna("").str.strip().str.lower().isin(["", "nan", "-nan"])
    wrong = numbers.isna() & stated
    if wrong.any():
        row = int(wrong.to_numpy().argmax())
        raise ReportError(f"{path}:{row + 2}: '{column.iloc[row]}' in column '{name}' is not a "
                          "number")
    return numbers.astype(float)
