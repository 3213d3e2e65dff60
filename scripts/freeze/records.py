"""Result files as short records of what they decide: words, estimates and errors."""
import csv
import re
from collections import defaultdict
from statistics import mean, median

from program import read_yaml

LONGEST = 1.1  # s
NUMBER = re.compile(r"\d+(\.\d+)?")  # what goes with the misfit is named with its size

def digits(number, count=5):
    return float(f"{number:.{count}g}") if isinstance(number, float) else number


def estimate(entry):
    """[value, sigma, status] as far as stated; a choice such as a gate or a time has a value alone."""
    if "sigma" not in entry:
        return digits(entry["value"])
    status = [entry["status"]] if "status" in entry else []
    return [digits(entry["value"]), digits(entry["sigma"], 3), *status]


def estimates(parameters):
    return {name: estimate(entry) for name, entry in parameters.items()}


def gains(node):
    """[before, after] of each measure of held-out flight."""
    return {key: [digits(node[key]["before"], 4), digits(node[key]["after"], 4)]
            for key in ("gain", "gain_open_loop") if key in node}


def cause_record(cause):
    record = {"id": cause["id"]}
    if "confirmed" in cause:
        record["confirmed"] = cause["confirmed"]
    record["confused_with"] = list(cause["confused_with"])
    return {**record, "parameters": estimates(cause["parameters"]), **gains(cause)}


def open_loop(misfit):
    """Error over replays of up to a second, [before, after], all axes together."""
    errors = {}
    for row in misfit.get("growth", []):
        if row["horizon_s"] > LONGEST:
            continue
        axes = list(row["rms_earth_m"].values())
        errors[f"open loop {row['horizon_s']:g} s"] = [
            digits(sum(axis[i] ** 2 for axis in axes) ** 0.5, 4) for i in (0, 1)]
    return errors


def diagnosis_record(diagnosis):
    record = {"verdict": diagnosis["verdict"],
              "causes": [cause_record(cause) for cause in diagnosis["causes"]]}
    if diagnosis.get("set_aside"):
        record["set_aside"] = [cause["id"] for cause in diagnosis["set_aside"]]
    if diagnosis.get("goes_with"):
        record["goes_with"] = sorted(NUMBER.sub("N", what) for what in diagnosis["goes_with"])
    of_all = gains(diagnosis) if len(record["causes"]) > 1 else {}  # one cause states its own
    record["errors"] = {**of_all, **open_loop(diagnosis.get("misfit", {}))}
    return record


def arc_figures(path):
    """(errors, counts) by estimator, of the arcs that have a truth."""
    errors, inside = defaultdict(list), defaultdict(int)
    with open(path, encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["final_point_error [m]"]:
                errors[row["estimator"]].append(float(row["final_point_error [m]"]))
                inside[row["estimator"]] += row["inside_95 [1]"] == "1"
    figures, counts = {}, {}
    for name, values in errors.items():
        figures[f"{name} mean"] = digits(mean(values), 4)
        figures[f"{name} median"] = digits(median(values), 4)
        counts[f"{name} arcs inside 95 %"] = f"{inside[name]} of {len(values)}"
    return figures, counts


def calibration_record(folder):
    result = read_yaml(folder / "calibration.yaml")
    record = {"verdict": result["verdict"], "parameters": estimates(result["parameters"])}
    if "whole_flight" in result:
        record["whole"] = estimates(result["whole_flight"]["parameters"])
    record["errors"], record["counts"] = arc_figures(folder / "arcs.csv")
    return record


def rotor_calibration_record(folder):
    result = read_yaml(folder / "calibration.yaml")
    errors = {f"open loop {row['horizon']:g} s": [row["before"], row["after"]]
              for row in result["open_loop"]}
    errors["halves differ, sigmas"] = digits(result["fit"]["halves_differ"], 3)
    return {"verdict": result["verdict"], "parameters": estimates(result["parameters"]),
            "errors": errors}


def benchmark_records(summary):
    """By flight and estimator."""
    records = {}
    for group in summary["groups"]:
        error = group["final_point_error"]
        records[f"{group['log']}, {group['label']}"] = {
            "errors": {key: error[key] for key in ("mean", "median", "rms") if key in error},
            "counts": {"arcs": group["arcs"], "inside 95 %": group.get("inside_95_ellipse")}}
    return records
