#!/usr/bin/python3
"""Puts faults into good logs and looks whether trueline-inspect finds and repairs them.

    scripts/blind/faults.py --build=build --work=OUT --seed=1 [--half=report] [--flights=oval_1,...]
        [--beside=gate_moved]

The measured flights of scripts/freeze (TRUELINE_DATA, default ../shared/data beside the source
folder) are converted, four simulated ones flown. Each is inspected untouched and with each fault of
faults_put.py, drawn by the seed. With --beside=WHAT one more error of BESIDE stands in the log all along: it
belongs to the untouched log, so that only what the fault adds is judged. A fault counts as found if a finding names it on the right stream;
as repaired if the log converted by corrected_map.yaml equals the untouched log, itself repaired by
its own map where inspect gave one: vectors to 8 % (rms), attitudes to 5 deg, stamps to the 12 ms
below which inspect names no lag, channels exactly. What has a result in OUT is not run again, so
that a run that was killed goes on where it stopped. The table goes to standard output and
OUT/faults.md.
"""
import random
import shlex
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE), str(HERE / "measured"), str(HERE.parent / "freeze")]

import numpy as np
import yaml

from faults_put import ACCEL, BESIDE, FAULTS, GYRO, PLACE
from flights import FLIGHTS, ROTORS
from measured_flights import convert, halves
from native import QUATERNION, Log, inverse, product
from program import SOURCE, app, clear_left_over, flags, read_yaml, refuse_other_draw, refuse_other_program
from program import parse as parse_flags

SIMULATED = ("hippodrome", "iros2016", "fast", "figure_eight")
HARMFUL = ("fatal", "biases", "widens")


def parse():
    parser = flags(__doc__, seed=1, half=("all", "tune", "report"), flights="", faults=",".join(FAULTS))
    parser.add_argument("--beside", choices=sorted(BESIDE), help="an error that is in every log")
    return parse_flags(parser)


def names(arguments):
    chosen = arguments.flights.split(",") if arguments.flights else None
    of = halves()
    measured = [n for n in FLIGHTS if arguments.half in (of[n], "all")]
    return [n for n in [*measured, *(f"sim_{s}" for s in SIMULATED)] if not chosen or n in chosen]


def base_log(arguments, name):
    """The good log, with the rotors that the vehicle's configuration states; None without its data."""
    folder = arguments.work / "base" / name
    if (folder / "log.yaml").exists():
        return folder
    if name.startswith("sim_"):
        flown = folder.with_name(name + "_flown")
        clear_left_over(flown)
        subprocess.run([app(arguments, "simulate"), f"--config={SOURCE}/config/simulate/{name[4:]}.yaml",
                        f"--out={flown}", f"--seed={arguments.seed}", "--quiet"], check=True)
        return written(arguments, Log(flown), name, folder)
    converted = convert(arguments, name)
    if converted is None:
        return None
    log = Log(converted)
    if name in ROTORS:
        config = read_yaml(SOURCE / f"config/calibrate/{ROTORS[name]}.yaml")
        rotors = (config.get("vehicle") or {}).get("rotors")
        if rotors:
            log.about["vehicle"] = {"rotors": [{"axis": [0, 0, -1], **r} for r in rotors]}
    return written(arguments, log, name, folder)


def written(arguments, log, name, folder):
    """The log's folder, once what stands beside is put in; None where the log has no place for that."""
    if arguments.beside and not BESIDE[arguments.beside](log, random.Random(f"{arguments.seed} {name}")):
        return None
    log.write(folder)
    return folder


def inspect(arguments, log, out):
    """Findings, and the folder of the repaired log (the log itself where nothing is repaired)."""
    if not (out / "inspection.yaml").exists():
        ran = subprocess.run([app(arguments, "inspect"), f"--log={log}", f"--out={out}", "--quiet",
                              "--report=false"], capture_output=True, text=True, check=False)
        if ran.returncode != 0:
            raise RuntimeError(f"{log}: {ran.stderr}")
    result = read_yaml(out / "inspection.yaml")
    if not result.get("corrected_by"):
        return result["findings"], log
    repaired = out / "repaired"
    clear_left_over(repaired)
    command = shlex.split(result["corrected_by"])[2:]  # trueline convert
    command = [f"--out={repaired}" if flag == "--out=REPAIRED" else flag for flag in command]
    ran = subprocess.run([app(arguments, "convert"), *command, "--quiet"], capture_output=True,
                         text=True, check=False)
    if ran.returncode != 0:
        raise RuntimeError(f"{log}: {ran.stderr}")
    return result["findings"], repaired


def angle_between(p, q):
    """deg, median over rows."""
    w = np.abs(product(inverse(p), q)[:, 0])
    return float(np.degrees(np.median(2 * np.arccos(np.clip(w, 0, 1)))))


def differences(good, made):
    """What is not as in the good log, as words."""
    wrong = []
    for name, stream in good.streams.items():
        other = made.streams[name]
        if len(other.t) != len(stream.t):
            wrong.append(f"{name}: rows")
            continue
        shift = abs(float(np.median(other.t - stream.t))) * 1e-9
        if shift > 0.012:
            wrong.append(f"{name}: {1e3 * shift:.0f} ms")
        for vector in (ACCEL, GYRO, PLACE):
            if vector[0] not in stream.columns or vector[1] not in stream.columns:
                continue
            a, b = stream.get(vector), other.get(vector)
            size = np.sqrt(np.mean(np.sum(a * a, axis=1)))
            if np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))) > 0.08 * size:
                wrong.append(f"{name}: {vector[0]}, ...")
        if "qw" in stream.columns and angle_between(stream.get(QUATERNION), other.get(QUATERNION)) > 5:
            wrong.append(f"{name}: attitude")
        if name in ("rotors", "motors"):
            if not np.allclose(stream.get(list(stream.columns)), other.get(list(stream.columns))):
                wrong.append(f"{name}: order")
    rotors = [log.about.get("vehicle", {}).get("rotors", []) for log in (good, made)]
    if [r["spin"] for r in rotors[0]] != [r["spin"] for r in rotors[1]]:
        wrong.append("spins")
    return wrong


def trial(arguments, name, fault, untouched):
    """The judge's record, kept in the trial's folder; None where the log has no place for the fault."""
    folder = arguments.work / "trials" / name / fault
    kept = folder / "outcome.yaml"
    if not kept.exists():
        outcome = run_trial(arguments, name, fault, untouched, folder)
        if outcome is None:
            return None
        part = kept.with_suffix(".part")
        part.write_text(yaml.safe_dump(outcome, sort_keys=False))
        part.rename(kept)
    outcome = read_yaml(kept)
    if not outcome["wrong"]:  # what went wrong is kept to look at
        for made in ("log", "repaired"):
            shutil.rmtree(folder / made, ignore_errors=True)
    return outcome


def run_trial(arguments, name, fault, untouched, folder):
    log, rng = Log(base_log(arguments, name)), random.Random(f"{arguments.seed} {name} {fault}")
    try:
        wanted = FAULTS[fault](log, rng)
    except IndexError:  # no stream to put it in
        return None
    if wanted is None:
        return None
    if not (folder / "log/log.yaml").exists():
        log.write(folder / "log")
    findings, repaired = inspect(arguments, folder / "log", folder)
    ids, streams = wanted
    before = {(f["id"], f["stream"]) for f in untouched[0]}
    found = [f for f in findings if f["id"] in ids and f["level"] in HARMFUL]
    beside = [f for f in findings if f["level"] in HARMFUL and f["id"] not in ids
              and (f["id"], f["stream"]) not in before]
    return {"flight": name, "fault": fault, "found": bool(found),
            "stream": any(f["stream"] in streams for f in found),
            "first": bool(findings) and findings[0]["id"] in ids,
            "wrong": differences(Log(untouched[1]), Log(repaired)),
            "beside": [f"{f['id']} ({f['stream']})" for f in beside]}


def table(untouched, trials):
    by_fault = defaultdict(list)
    for t in trials:
        by_fault[t["fault"]].append(t)
    lines = ["| fault | logs | found | first of the list | repaired | a false finding beside |",
             "|---|---|---|---|---|---|"]
    for fault, of in by_fault.items():
        def count(good):
            return sum(1 for t in of if good(t))
        lines.append(f"| {fault} | {len(of)} | {count(lambda t: t['found'])} | "
                     f"{count(lambda t: t['first'])} | {count(lambda t: not t['wrong'])} | "
                     f"{count(lambda t: t['beside'])} |")
    lines += ["", "Untouched logs:", "", "| flight | findings above a note |", "|---|---|"]
    for name, (findings, _) in untouched.items():
        harmful = [f"{f['id']} of {f['stream']} ({f['size']} {f['unit']})" for f in findings
                   if f["level"] in HARMFUL]
        lines.append(f"| {name} | {'; '.join(harmful) or 'none'} |")
    lines += ["", "Not as they should be:", ""]
    for t in trials:
        if t["found"] and not t["wrong"] and not t["beside"]:
            continue
        lines.append(f"- {t['flight']}, {t['fault']}: found {t['found']}; after repair differ: "
                     f"{', '.join(t['wrong']) or 'nothing'}; beside: {', '.join(t['beside']) or 'none'}")
    return "\n".join(lines) + "\n"


def main():
    arguments = parse()
    arguments.work.mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    draw = {"seed": arguments.seed, **({"beside": arguments.beside} if arguments.beside else {})}
    refuse_other_draw(arguments.work, draw)
    untouched, trials = {}, []
    for name in names(arguments):
        log = base_log(arguments, name)
        if log is None:
            print(f"{name}: left out, without its files in {arguments.data} or a place for what stands beside",
                  file=sys.stderr)
            continue
        untouched[name] = inspect(arguments, log, arguments.work / "inspected" / name)
        for fault in arguments.faults.split(","):
            outcome = trial(arguments, name, fault, untouched[name])
            if outcome is not None:
                trials.append(outcome)
    (arguments.work / "trials.yaml").write_text(yaml.safe_dump(trials, sort_keys=False))
    text = table(untouched, trials)
    (arguments.work / "faults.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
