#!/usr/bin/python3
"""Hides forces that no named effect states in simulated flights, and judges what the open catalogue
says of them.

    scripts/blind/terms.py --build=build --work=/tmp/terms --flights=100 --seed=1
    scripts/blind/terms.py ... --drive=rotors
    scripts/blind/terms.py ... --drive=rotors --blades

A fifth of the flights hides nothing, a fifth a named effect, the rest one force: along an axis of the
vehicle with a speed or turn rate or a product of two, or along north or east at a place of the course.
The simulator computes these forces at every sample. A force counts if it is at least twice the size
that the flight shows with good chance: six sigmas of the same term, as terms.csv states them; of a
place, of the hump nearest to it. With --blades the simulator computes the rotors by blade elements, so
that the air's effects are in every flight, in a form that no estimator has; causes and terms that
describe them are not false. The table goes to standard output and WORK/table.md. Flights that have a
result in WORK are not flown again, so that a run that was killed goes on where it stopped.
"""
import csv
import importlib
import math
import random
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "freeze")]
from program import (SOURCE, clear_left_over, drawn_effects, flags, parse, refuse_other_draw,
                     refuse_other_program)

SPEEDS = ["forward speed", "sideways speed", "sink rate"]
RATES = ["roll rate", "pitch rate", "yaw rate"]
DRAW = ("seed", "drive", "blades")
SIGMAS = 6.0  # of a size that is shown with good chance, over all terms
# What blades do to a rotor in moving air; no false cause with --blades.
OF_AIR = {"body_drag", "linear_drag", "rotor_speed_drag", "rotor_inflow", "translational_lift", "air_moment"}
# The same in terms: drag, thrust lost in a climb, hubs that brake turns, and blades that flap.
TERMS_OF_AIR = {("force", "x_B", "forward speed"), ("force", "y_B", "sideways speed"),
                ("force", "z_B", "sink rate"), ("moment", "x_B", "roll rate"), ("moment", "y_B", "pitch rate"),
                ("moment", "x_B", "sideways speed"), ("moment", "y_B", "forward speed")}
HUMP = re.compile(r"(force) along (\S+) with being within about ([\d.]+) m of \((-?[\d.]+), (-?[\d.]+)\)")


def draw_force(rng, drive, places):
    """An entry of the simulator's `forces`."""
    if places and rng.random() < 0.3:
        extent = max(max(p[i] for p in places) - min(p[i] for p in places) for i in (0, 1))
        return {"along": rng.choice(["north", "east"]), "place": [round(v, 2) for v in rng.choice(places)],
                "radius": round(extent * rng.uniform(0.08, 0.16), 2), "size": round(rng.uniform(0.3, 2.0), 3)}
    axes = ["x_B", "y_B"] + (["z_B"] if drive == "rotors" else [])
    first = rng.choice(RATES + ["sink rate"])
    with_what = first if rng.random() < 0.5 else f"{rng.choice(SPEEDS[:2])} * {first}"
    size = rng.choice([-1, 1]) * 10 ** rng.uniform(*(-0.5, 0.7) if drive == "rotors" else (-1.5, -0.2))
    return {"along": rng.choice(axes), "goes_with": with_what, "size": round(size, 4)}


def positions(config):
    """Places on the course that a configuration states; none on the rotor drive's random flights."""
    course = config.get("course", {})
    points = [p["position"] for p in course.get("corners") or course.get("waypoints") or []]
    return [[0.5 * (a[i] + b[i]) for i in (0, 1)] for a, b in zip(points, points[1:] + points[:1])]


def names_of(force):
    """Names that the program may give to a force that goes with the motion."""
    factors = force["goes_with"].split(" * ")
    if len(factors) == 1:
        return {f"force along {force['along']} with {factors[0]}"}
    return {f"force along {force['along']} with {' times '.join(order)}" for order in (factors, factors[::-1])}


def is_same(name, force):
    if "goes_with" in force:
        return name in names_of(force)
    hump = HUMP.match(name)
    if not hump or hump[2] != force["along"]:
        return False
    return math.dist(force["place"], (float(hump[4]), float(hump[5]))) < force["radius"] + float(hump[3])


def run(arguments, draw, index):
    """The record of one flight."""
    rng, name = random.Random(f"{arguments.seed} {index}"), f"f{index:03d}"
    course = draw.COURSES[index % len(draw.COURSES)]
    config = yaml.safe_load((SOURCE / f"config/{draw.FOLDER}/{course}.yaml").read_text())
    kind = index % 5
    hideable = [e for e in draw.EFFECTS if not (arguments.blades and e in OF_AIR)]
    effects = [rng.choice(hideable)] if kind == 1 else []
    draw.draw_flight(config, arguments.seed * 1000 + index, effects)
    force = draw_force(rng, arguments.drive, positions(config)) if kind > 1 else None
    if arguments.blades:
        config["simulation"]["blades"] = {}
    if force:
        (config["simulation"] if arguments.drive == "rotors" else config)["forces"] = [force]
    folder = arguments.work / name
    if not (folder / "result/diagnosis.yaml").exists():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "config.yaml").write_text(yaml.safe_dump(config))
        clear_left_over(folder / "log")
        for command in (["simulate", f"--config={folder / 'config.yaml'}", f"--out={folder / 'log'}",
                         f"--seed={arguments.seed * 1000 + index}"],
                        ["diagnose", f"--log={folder / 'log'}", f"--out={folder / 'result'}",
                         "--report=false", *[flag.format(source=SOURCE) for flag in draw.DIAGNOSE]]):
            done = subprocess.run([arguments.build / f"apps/trueline-{command[0]}", *command[1:], "--quiet"],
                                  capture_output=True, text=True, check=False)
            if done.returncode not in (0, 3):
                print(f"{name}: {done.stderr.strip()}", file=sys.stderr)
                return None
    return judge(name, kind, effects, force, folder / "result", arguments.blades)


def is_of_air(term):
    return (term["enters"], term["along"], term["goes_with"]) in TERMS_OF_AIR


def judge(name, kind, effects, force, folder, blades):
    result = yaml.safe_load((folder / "diagnosis.yaml").read_text())
    true_of_all = OF_AIR if blades else set()
    terms = [t for t in result.get("terms") or [] if not (blades and is_of_air(t))]
    record = {"flight": name, "kind": ["nothing", "effect", "force", "force", "force"][kind], "effects": effects,
              "force": force, "verdict": result["verdict"], "causes": [c["id"] for c in result["causes"]],
              "false_causes": [c["id"] for c in result["causes"] if c["id"] not in true_of_all.union(effects)],
              "terms": [t["text"] for t in terms],
              "terms_of_air": [t["text"] for t in result.get("terms") or [] if t not in terms]}
    if force is None:
        return record
    said = [[f"{t['enters']} {'about' if t['enters'] == 'attitude' else 'along'} {t['along']} "
             f"with {t['goes_with']}", *(t.get("fits_alike") or [])] for t in terms]
    with (folder / "terms.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if is_same(row["term"], force)]
    sigma = min((float(row["sigma"]) for row in rows), default=math.inf)
    record["times"] = abs(force["size"]) / (SIGMAS * sigma) if sigma > 0.0 else 0.0
    record["first"] = bool(said) and is_same(said[0][0], force)
    record["alike"] = bool(said) and any(is_same(name, force) for name in said[0])
    record["beside"] = sum(not any(is_same(name, force) for name in names) for names in said)
    if record["first"] and "goes_with" in force:
        size = terms[0]["size"]
        record["sigmas_off"] = abs(size["value"] - force["size"]) / size["sigma"]
    return record


def share(part, whole):
    return f"{part} of {whole}" + (f" ({100 * part / whole:.0f} %)" if whole else "")


def table(records):
    of = {kind: [r for r in records if r["kind"] == kind] for kind in ("nothing", "effect", "force")}
    counted = [r for r in of["force"] if r["times"] >= 2.0]
    sized = [r["sigmas_off"] for r in of["force"] if "sigmas_off" in r]
    rows = [("a term on flights that hide nothing", share(sum(bool(r["terms"]) for r in of["nothing"]), len(of["nothing"]))),
            ("a term beside a named effect", share(sum(bool(r["terms"]) for r in of["effect"]), len(of["effect"]))),
            ("forces at twice their detectable size, described first", share(sum(r["first"] for r in counted), len(counted))),
            ("first, or fitting alike", share(sum(r["alike"] for r in counted), len(counted))),
            ("of them at a place", share(sum(r["first"] for r in counted if "place" in r["force"]),
                                         sum("place" in r["force"] for r in counted))),
            ("the hidden effect, named", share(sum(r["effects"][0] in r["causes"] for r in of["effect"]), len(of["effect"]))),
            ("a false cause on flights without a force", share(sum(bool(r["false_causes"]) for r in of["nothing"] + of["effect"]),
                                                               len(of["nothing"] + of["effect"]))),
            ("a false cause on flights with a force only", share(sum(bool(r["false_causes"]) for r in of["force"]), len(of["force"]))),
            ("another term beside the force", share(sum(r["beside"] > 0 for r in of["force"]), len(of["force"]))),
            ("sizes within 2 sigma", share(sum(s < 2.0 for s in sized), len(sized)))]
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)]) + "\n"


def main():
    parser = flags(__doc__, flights=100, seed=1, jobs=2, drive=("imu", "rotors"), blades=False)
    arguments = parse(parser)
    if arguments.blades and arguments.drive != "rotors":
        parser.error("--blades needs --drive=rotors")
    arguments.work.mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    refuse_other_draw(arguments.work, {name: getattr(arguments, name) for name in DRAW})
    draw = importlib.import_module({"imu": "draw", "rotors": "draw_rotors"}[arguments.drive])
    draw.EFFECTS.update(drawn_effects(arguments.build, arguments.drive))
    with ThreadPoolExecutor(arguments.jobs) as pool:
        records = [r for r in pool.map(lambda i: run(arguments, draw, i), range(arguments.flights)) if r]
    (arguments.work / "trials.yaml").write_text(yaml.safe_dump(records, sort_keys=False, width=150))
    text = table(records)
    (arguments.work / "table.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
