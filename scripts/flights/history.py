"""Vehicles over time: what each flight's comparison with the earlier ones says, and their trims."""
import pandas as pd
import yaml

TRIM_COLUMNS = ["flight", "vehicle", "date", "session", "parameter", "value", "sigma", "unit"]


def _reason(cause):
    """A cause in words."""
    if "text" in cause:
        return cause["text"]
    sizes = (f"{name} = {size['value']}" + (f" +- {size['sigma']} {size['unit']}" if "sigma" in size else "")
             for name, size in cause["parameters"].items())
    return f"{cause['id']}: {', '.join(sizes)}"


def outcome_of(result):
    """(outcome, why) of a comparison, whose rotor pairs have one text. What a wrong log shows is no change."""
    if result is None:
        return "not compared", ""
    if result["verdict"] == "unexplained" and result.get("log_faults"):
        return "wrong log", "; ".join(result["log_faults"])
    reasons = list(dict.fromkeys(_reason(cause) for cause in result.get("causes") or []))
    trim = result if result.get("drive") == "commands" else result.get("trim") or {}
    if not reasons and trim.get("verdict") == "unexplained":
        reasons.append("the commands that hold it in the air have changed in a way that no cause explains")
    return "differs" if reasons else "alike", "; ".join(reasons)


def flight_rows(flights, out):
    """One row a flight, in order of time: sessions are days, counted from 1 for each vehicle."""
    days = {}
    rows = []
    for flight in sorted(flights, key=lambda f: f.date):
        of_vehicle = days.setdefault(flight.vehicle, {})
        file = out / "against" / flight.flight / "diagnosis.yaml"
        result = yaml.safe_load(file.read_text()) if file.exists() else None
        outcome, why = outcome_of(result)
        rows.append({"flight": flight.flight, "vehicle": flight.vehicle, "date": flight.date,
                     "session": of_vehicle.setdefault(flight.day, len(of_vehicle) + 1),
                     "earlier": len(result["against"]) if result else 0, "outcome": outcome, "why": why})
    return pd.DataFrame(rows)


def trim_rows(rows, out):
    """One row a flight and command. Each comparison lists the trims of the flight and the earlier ones."""
    known, trims = rows.set_index("flight"), {}
    for path in sorted((out / "against").glob("*/trims.csv")):
        for row in pd.read_csv(path).to_dict("records"):
            flight = row["log"].rstrip("/").rsplit("/", 1)[-1]
            for column in (c for c in row if c.startswith("u") and flight in known.index):
                name = column.split()[0]
                trims[flight, name] = [flight, *known.loc[flight, ["vehicle", "date", "session"]],
                                       f"trim {name}", row[column], row[f"sigma_{name} [1]"], "1"]
    return pd.DataFrame(trims.values(), columns=TRIM_COLUMNS)


def first_changes(rows):
    """One row a vehicle: the first flight that differs from the earlier ones, and how many do."""
    table = []
    for vehicle, group in rows.groupby("vehicle"):
        changed = group[group.outcome == "differs"]
        first = changed.iloc[0] if len(changed) else None
        table.append({"vehicle": vehicle, "sessions": int(group.session.max()),
                      "compared": int((group.outcome != "not compared").sum()), "differ": len(changed),
                      "first that differs": "" if first is None else first.flight,
                      "date": "" if first is None else first.date,
                      "why": "" if first is None else first.why})
    return pd.DataFrame(table)


def write_history(rows, trims, path):
    """{VEHICLE: {first_change: {...} or null, flights: [...]}}"""
    sizes = {flight: {t.parameter.split()[1]: {"value": float(t.value), "sigma": float(t.sigma)}
                      for t in group.itertuples()} for flight, group in trims.groupby("flight")}
    history = {}
    for vehicle, group in rows.groupby("vehicle"):
        flights = [{**row, **({"trim": sizes[row["flight"]]} if row["flight"] in sizes else {})}
                   for row in group.drop(columns="vehicle").to_dict("records")]
        first = next((f for f in flights if f["outcome"] == "differs"), None)
        history[vehicle] = {"first_change": first and {k: first[k] for k in ("flight", "date", "session", "why")},
                            "flights": flights}
    path.write_text(yaml.safe_dump(history, sort_keys=False, width=110))
