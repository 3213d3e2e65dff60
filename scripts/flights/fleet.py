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

    @property
    def day(self):
        """The session: nothing is rebuilt within a day."""
        return self.date[:10]


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


def earlier_flights(flights, most):
    """By flight, the last `most` ones of its vehicle before it."""
    earlier, last = {}, {}
    for flight in sorted(flights, key=lambda f: f.date):
        before = last.setdefault(flight.vehicle, [])
        earlier[flight.flight] = before[-most:] if most else []
        before.append(flight)
    return earlier


def link_sessions(folder, flights, log_of):
    """Links to the logs, in a folder for each session; returns these folders with commas between."""
    for flight in flights:
        link = folder / flight.day / flight.flight
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.is_symlink():
            link.symlink_to(Path(log_of(flight)).resolve())
    return ",".join(sorted({str(folder / flight.day) for flight in flights}))


def find_program(apps, verb):
    """The path of trueline-VERB; None where there is none."""
    return shutil.which(f"trueline-{verb}", path=apps or os.environ.get("PATH"))
