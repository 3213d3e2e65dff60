"""The table of flights, and where programs are."""
import csv
import datetime
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

COLUMNS = ["flight", "vehicle", "date", "log"]


@dataclass
class Flight:
    flight: str   # a name of its own, also that of its folders
    vehicle: str
    date: str     # ISO 8601, so that text sorts by time
    log: str
    map: str = ""


def is_date(text):
    try:
        datetime.datetime.fromisoformat(text)
    except ValueError:
        return False
    return True


def read_flights(path):
    """Raises SystemExit, with the line, for a table that can't be used."""
    with open(path, newline="", encoding="utf-8-sig") as file:  # spreadsheets write a byte order mark
        rows = list(csv.DictReader(file))
    flights, seen = [], set()
    for line, row in enumerate(rows, start=2):
        missing = [name for name in COLUMNS if not row.get(name)]
        if missing:
            raise SystemExit(f"{path}:{line}: {', '.join(missing)} is missing; a row needs "
                             f"{', '.join(COLUMNS)}")
        if row["flight"] in seen or "/" in row["flight"]:
            raise SystemExit(f"{path}:{line}: flight '{row['flight']}' needs a name of its own "
                             "without '/'")
        if not is_date(row["date"]):
            raise SystemExit(f"{path}:{line}: date '{row['date']}' is none of ISO 8601; write it as "
                             "2024-03-01 or 2024-03-01T16:20:00Z")
        seen.add(row["flight"])
        flights.append(Flight(*(row[name] for name in COLUMNS), row.get("map") or ""))
    if not flights:
        raise SystemExit(f"{path}: has no flights; it needs the columns {', '.join(COLUMNS)}")
    return flights


def is_native(log):
    return (Path(log) / "log.yaml").exists()


def find_program(apps, verb):
    """The path of trueline-VERB; None where there is none."""
    return shutil.which(f"trueline-{verb}", path=apps or os.environ.get("PATH"))
