#!/usr/bin/python3
"""Merges the results of many flights: one table, one page, and which vehicle needs a look.

    merge.py --flights=flights.csv --out=flights_out

Reads what the workflow wrote in OUT; writes OUT/parameters.csv (one row a flight and parameter),
OUT/vehicles.csv (one row a vehicle), OUT/history.yaml (each flight against the earlier ones) and
OUT/report.html.
"""
import argparse
import collections
import sys
from pathlib import Path

import pandas as pd
import yaml

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "report"))

import history
from fleet import read_flights
from fleet_page import fleet_page
from fleet_statistics import against_the_fleet, cause_by_chance, limit, vehicle_rows

TRUSTED = ("identified", "weak")


def read_yaml(path):
    return yaml.safe_load(path.read_text()) if path.exists() else None


def flight_rows(flights, out):
    """One row a flight: how each verb ended, the verdict, the causes."""
    rows = []
    for flight in flights:
        status = {path.stem: read_yaml(path)
                  for path in (out / "status" / flight.flight).glob("*.yaml")}
        calibration = read_yaml(out / "calibrate" / flight.flight / "calibration.yaml") or {}
        diagnosis = read_yaml(out / "diagnose" / flight.flight / "diagnosis.yaml") or {}
        failed = [f"{verb}: {s['message'].splitlines()[0] if s['message'] else 'no result'}"
                  for verb, s in sorted(status.items()) if s["code"] != 0]
        rows.append({"flight": flight.flight, "vehicle": flight.vehicle, "date": flight.date,
                     "verdict": calibration.get("verdict", "none"),
                     "causes": [c["id"] for c in diagnosis.get("causes") or []],
                     "parameters": calibration.get("parameters") or {},
                     "failed": "; ".join(failed),
                     "cpu_seconds": sum(s["cpu_seconds"] for s in status.values()),
                     "memory_mb": max((s["memory_mb"] for s in status.values()), default=0)})
    return pd.DataFrame(rows)


def parameter_rows(flights):
    rows = [{"flight": f.flight, "vehicle": f.vehicle, "date": f.date, "parameter": name,
             **{key: estimate[key] for key in ("value", "sigma", "unit", "status")}}
            for f in flights.itertuples() if f.verdict != "unusable"
            for name, estimate in f.parameters.items()]
    table = pd.DataFrame(rows, columns=["flight", "vehicle", "date", "parameter", "value", "sigma",
                                        "unit", "status"])
    day = pd.to_datetime(table.date, utc=True)
    table["days"] = (day - day.min()).dt.total_seconds() / 86400.0
    return table


def reasons_of_parameters(table):
    """vehicle -> reasons to look at it; and the rows of all parameters."""
    trusted = table[table.status.isin(TRUSTED) & (table.sigma > 0)]
    parts = []
    for name, group in trusted.groupby("parameter"):
        rows = vehicle_rows(group)
        rows.insert(1, "parameter", name)
        rows["unit"] = group.unit.iloc[0]
        rows["fleet_z"] = against_the_fleet(rows)
        parts.append(rows)
    rows = pd.concat(parts) if parts else pd.DataFrame()
    reasons = collections.defaultdict(list)
    bound = limit(3 * len(rows))
    for row in rows.itertuples():
        if abs(row.fleet_z) > bound:
            reasons[row.vehicle].append(f"{row.parameter} = {row.mean:.3g} +- {row.sigma:.2g} "
                                        f"{row.unit} stands out ({abs(row.fleet_z):.1f} sigmas)")
        if abs(row.drift_z) > bound:
            reasons[row.vehicle].append(f"{row.parameter} drifts by {row.slope_by_day:.3g} "
                                        f"{row.unit} a day ({abs(row.drift_z):.1f} sigmas)")
        if row.farthest_z > bound:
            reasons[row.vehicle].append(f"{row.parameter} of flight {row.farthest} is unlike the "
                                        f"vehicle's others ({row.farthest_z:.1f} sigmas)")
    return reasons, rows


def reasons_of_causes(flights, reasons):
    """A cause that comes on more flights of a vehicle than chance allows."""
    counts = [(vehicle, cause, count, len(group))
              for vehicle, group in flights[flights.verdict != "none"].groupby("vehicle")
              for cause, count in collections.Counter(sum(group.causes, [])).items()]
    for vehicle, cause, count, number in counts:
        if not cause_by_chance(count, number, max(len(counts), flights.vehicle.nunique())):
            reasons[vehicle].append(f"{cause} is named on {count} of {number} flights")


def vehicle_table(flights, reasons):
    rows = []
    for vehicle, group in flights.groupby("vehicle"):
        rows.append({"vehicle": vehicle, "flights": len(group),
                     "usable": int((group.verdict == "usable").sum()),
                     "poor": int((group.verdict == "poor").sum()),
                     "no result": int(group.verdict.isin(["none", "unusable"]).sum()),
                     "look": "yes" if reasons.get(vehicle) else "no",
                     "reasons": "; ".join(reasons.get(vehicle, []))})
    return pd.DataFrame(rows).sort_values(["look", "vehicle"], ascending=[False, True])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--flights", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    listed = read_flights(arguments.flights)
    flights = flight_rows(listed, arguments.out)
    table = parameter_rows(flights)
    reasons, rows = reasons_of_parameters(table)
    reasons_of_causes(flights, reasons)
    vehicles = vehicle_table(flights, reasons)
    table.drop(columns="days").to_csv(arguments.out / "parameters.csv", index=False)
    vehicles.to_csv(arguments.out / "vehicles.csv", index=False)
    compared = history.flight_rows(listed, arguments.out)
    trims = history.trim_rows(compared, arguments.out)
    history.write_history(compared, trims, arguments.out / "history.yaml")
    fleet_page(flights, table, rows, vehicles, compared, trims).write(arguments.out / "report.html")
    look = vehicles[vehicles.look == "yes"]
    print(f"{len(flights)} flights of {len(vehicles)} vehicles; to look at: "
          f"{', '.join(look.vehicle) if len(look) else 'none'}")


if __name__ == "__main__":
    main()
