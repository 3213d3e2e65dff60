"""Whole-flight calibrations of simulated flights, and how often their intervals hold the truth."""
import sys

from program import SOURCE, read_yaml, run_script
from records import calibration_record, digits


def run(arguments):
    folder = arguments.work / "coverage"
    run_script(arguments, [sys.executable, SOURCE / "scripts/coverage.py", f"--out={folder}",
                           f"--build={arguments.build}", f"--flights={arguments.flights}",
                           f"--jobs={arguments.jobs}"])
    return {"coverage": coverage(read_yaml(folder / "coverage.yaml")), "flights": flights(folder)}


def coverage(rows):
    return {name: {"counts": {"inside 95 %": f"{round(row['inside_95'] * row['flights'])} of "
                                             f"{row['flights']}"},
                   "errors": {"rms in sigmas": digits(row["rms_in_sigmas"], 4)}}
            for name, row in rows.items()}


def flights(folder):
    """What the whole flight says; windows are frozen by the measured flights."""
    records = {}
    for flight in sorted(folder.glob("flight_*/")):
        record = calibration_record(flight / "result")
        records[flight.name] = {key: record[key] for key in ("verdict", "whole", "errors")}
    return records
