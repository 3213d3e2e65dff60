#!/usr/bin/python3
"""Diagnoses measured flights as they are and judges what is named.

    scripts/blind/measured/untouched.py --build=build --work=OUT
    scripts/blind/measured/untouched.py --build=build --work=OUT --drive=rotors --flights=throw_267

Each flight is diagnosed with a second flight of its vehicle (--log=A,B), fitted to mocap and to the
fixes. What the flight really has is not known, so a named cause is judged by what speaks against it:
its witness, the second flight, held-out flight, and what the data set rules out (a wind indoors, an
error of detector or map where fixes were sampled from mocap). The table goes to standard output and
OUT/untouched.md, the figures to OUT/untouched.yaml. A run that was killed goes on where it stopped.
"""
import sys
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True

import yaml

import run
from judge_measured import GAINS, OF_FIXES, cause_record
from measured_flights import (ALL, HIDDEN_IN, ROTOR_CONFIGS, convert, halves, has_sampled_fixes,
                              second_flight)
from program import read_yaml, refuse_other_program

AGAINST = {"witness": "refuted by its witness",
           "second": "not on the second flight, yet in the model",
           "gain": "no clear gain on held-out flight",
           "impossible": "impossible"}


def candidates(arguments):
    """Flights of the half and of the drive; those outside of the halves belong to the report."""
    of_half = halves()
    names = [name for name in ALL if arguments.half in (of_half.get(name, "report"), "all")]
    if arguments.drive == "rotors":
        names = [name for name in names if name in ROTOR_CONFIGS]
    return run.chosen(sorted(names, key=lambda name: (name not in HIDDEN_IN, name)), arguments.flights)


def gained(cause):
    """Whether one measure of held-out flight is clearly positive; None where none was taken."""
    intervals = [cause[key]["interval95"] for key in GAINS if "interval95" in cause.get(key, {})]
    return any(low > 0 for low, _ in intervals) if intervals else None


def believed(cause, model):
    return any(effect["id"] == cause["id"] for effect in model.get("effects") or [])


def against(cause, model, sampled, indoors):
    """Names of AGAINST that hold for a named cause."""
    found = {"witness": cause.get("witness", {}).get("says") == "refutes",
             "second": cause.get("confirmed") is False and believed(cause, model),
             "gain": gained(cause) is False,
             "impossible": (sampled and cause["id"] in OF_FIXES) or (indoors and cause["id"] == "wind")}
    return [name for name, holds in found.items() if holds]


def record_of(flight, fit, about, folder, diagnosis):
    if diagnosis is None:
        return {"flight": flight, "fit": fit, "verdict": None, "errors": read_yaml(folder / "outcome.yaml")}
    model = read_yaml(folder / "model.yaml")
    causes = [{**cause_record(cause, diagnosis), "confirmed": cause.get("confirmed"),
               "in_model": believed(cause, model),
               "against": against(cause, model, has_sampled_fixes(flight),
                                  about.get("environment") == "indoors")}
              for cause in diagnosis["causes"]]
    return {"flight": flight, "fit": fit, "verdict": diagnosis["verdict"], "causes": causes,
            "set_aside": [cause["id"] for cause in diagnosis.get("set_aside") or []]}


def diagnose(arguments, flight, fit, names):
    log = convert(arguments, flight)
    if log is None:
        return {"flight": flight, "fit": fit, "verdict": None, "errors": "does not convert"}
    other = second_flight(flight, names)
    second = convert(arguments, other) if other else None
    folder = arguments.work / "results" / f"{arguments.drive}_{flight}_{fit}"
    logs = ",".join(str(run.as_fitted(path, fit)) for path in (log, second) if path)
    diagnosis = run.diagnose(arguments, flight, fit, logs, folder)
    record = record_of(flight, fit, read_yaml(log / "log.yaml"), folder, diagnosis)
    print(f"{flight}, {fit}: {record['verdict']}: "
          + ", ".join(cause["id"] for cause in record.get("causes", [])), file=sys.stderr, flush=True)
    return {**record, "second": other}


def shown(value, sigma):
    return f"{value:.3g}" + (f" +- {sigma:.2g}" if sigma is not None else "")


def gain_text(cause):
    return "; ".join(f"{before:.3g} -> {after:.3g} " +
                     ("(too few)" if low is None else f"({low:.2g} to {high:.2g})")
                     for before, after, low, high, _ in
                     (cause[key] for key in GAINS if key in cause)) or "-"


def cause_row(record, cause):
    sizes = ", ".join(f"{name} {shown(*pair)}" for name, pair in cause["parameters"].items())
    confirmed = {True: "yes", False: "no", None: "-"}[cause["confirmed"]]
    return (f"| {record['flight']}, {record['fit']} | {record['verdict']} | {cause['id']} {sizes} "
            f"| {1 - cause['confidence']:.1g} | {cause.get('witness', {}).get('says', '-')} "
            f"| {gain_text(cause)} | {confirmed} | {'yes' if cause['in_model'] else 'no'} "
            f"| {', '.join(cause['against']) or '-'} |")


def table(records):
    lines = ["| flight, fit | verdict | cause | 1 - confidence | witness | gain on held-out flight "
             "(95 %): final point, m; open loop, m; witness's stream | on second flight | in model | against it |",
             "|---" * 9 + "|"]
    for record in records:
        causes = record.get("causes") or []
        lines += [cause_row(record, cause) for cause in causes]
        if not causes:
            lines.append(f"| {record['flight']}, {record['fit']} | {record['verdict'] or 'none'} "
                         "| | | | | | | |")
    causes = [cause for record in records for cause in record.get("causes") or []]
    lines += ["", f"| {len(causes)} causes on {len(records)} diagnoses | |", "|---|---|"]
    lines += [f"| {text} | {sum(name in cause['against'] for cause in causes)} |"
              for name, text in AGAINST.items()]
    lines.append(f"| nothing against it | {sum(not cause['against'] for cause in causes)} |")
    return "\n".join(lines) + "\n"


def main():
    arguments = run.parse(__doc__)
    (arguments.work / "results").mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    names = candidates(arguments)
    vehicles = [name for name in ALL if arguments.drive == "imu" or name in ROTOR_CONFIGS]
    pairs = [(name, fit) for name in names for fit in arguments.fits]
    for name in names:
        convert(arguments, name)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        records = list(pool.map(lambda pair: diagnose(arguments, *pair, vehicles), pairs))
    (arguments.work / "untouched.yaml").write_text(yaml.safe_dump(records, sort_keys=False, width=150))
    text = table(records)
    (arguments.work / "untouched.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
