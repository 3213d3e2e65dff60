#!/usr/bin/python3
"""The blind set: hides effects in simulated flights, diagnoses the logs alone, then judges.

    scripts/blind/run.py --build=build --work=/tmp/blind --flights=300 --seed=1 --jobs=2
    scripts/blind/run.py --drive=rotors ...     the same for the model driven by rotor speeds
    scripts/blind/run.py --fit=alone ...        logs without mocap; --fit=mocap: mocap is data

Three steps, each in a folder of its own, so that the diagnosis never sees the truth: logs/ (native
logs), sealed/ (configurations, truth, what was hidden), results/ (diagnosis.yaml by flight). The
table goes to standard output and WORK/table.md. Flights that have a result already are not flown
again, so that a run that was killed goes on where it stopped.
"""
import importlib
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "freeze")]
from judge import table
from program import (SOURCE, clear_left_over, drawn_effects, flags, parse, refuse_other_draw,
                     refuse_other_program)


def plan(draw, flights, seed):
    """(name, seed, course, hidden ids), by the drive's module `draw`: a fifth hides nothing, a tenth
    two effects, a tenth what is outside of the catalogue; the rest one effect, all in turn."""
    ids = list(draw.EFFECTS)
    for i in range(flights):
        kind, turn = i % 10, i // 10
        if kind in (0, 5):
            hidden = []
        elif kind == 9:
            hidden = ["outside"]
        elif kind == 4:
            hidden = [ids[turn % len(ids)], ids[(turn * 5 + 7) % len(ids)]]
            hidden = hidden if hidden[0] != hidden[1] else hidden[:1]
        else:
            singles = [1, 2, 3, 6, 7, 8]
            hidden = [ids[(turn * len(singles) + singles.index(kind)) % len(ids)]]
        yield f"f{i:03d}", seed * 1000 + i, draw.COURSES[(i + turn) % len(draw.COURSES)], hidden


def fly(arguments, draw, name, seed, course, hidden):
    sealed, logs = arguments.work / "sealed", arguments.work / "logs"
    config = yaml.safe_load((SOURCE / f"config/{draw.FOLDER}/{course}.yaml").read_text())
    truth = draw.draw_flight(config, seed, hidden)
    file = sealed / f"{name}.yaml"
    file.write_text(yaml.safe_dump(config))
    clear_left_over(logs / name)
    simulate = subprocess.run([arguments.build / "apps/trueline-simulate", f"--config={file}",
                               f"--out={logs / name}", f"--seed={seed}", "--quiet"],
                              capture_output=True, text=True, check=False)
    flown = simulate.returncode == 0
    if flown:
        (logs / f"{name}.truth.yaml").rename(sealed / f"{name}.truth.yaml")
        draw.spoil(logs / name, truth[0] if truth else {"id": ""})
        if arguments.fit == "alone":
            (logs / name / "mocap.csv").unlink()
    (sealed / f"{name}.hidden.yaml").write_text(
        yaml.safe_dump({"course": course, "effects": truth, "flown": flown}))
    return flown


def diagnose(arguments, draw, name):
    drive = [flag.format(source=SOURCE) for flag in draw.DIAGNOSE]
    drive += ["--fit_to=mocap"] if arguments.fit == "mocap" else []
    subprocess.run([arguments.build / "apps/trueline-diagnose", f"--log={arguments.work / 'logs' / name}",
                    f"--out={arguments.work / 'results' / name}", "--quiet", "--report=false",
                    *drive],
                   capture_output=True, check=False)


def one(arguments, draw, flight):
    if (arguments.work / "results" / flight[0] / "diagnosis.yaml").exists():
        return
    if fly(arguments, draw, *flight):
        diagnose(arguments, draw, flight[0])
    shutil.rmtree(arguments.work / "logs" / flight[0], ignore_errors=True)


def main():
    arguments = parse(flags(__doc__, flights=300, seed=1, jobs=2, drive=("imu", "rotors"),
                            fit=("fixes", "mocap", "alone")))
    draw = importlib.import_module({"imu": "draw", "rotors": "draw_rotors"}[arguments.drive])
    draw.EFFECTS.update(drawn_effects(arguments.build, arguments.drive))
    for folder in ("logs", "sealed", "results"):
        (arguments.work / folder).mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    refuse_other_draw(arguments.work, {"seed": arguments.seed, "drive": arguments.drive, "fit": arguments.fit})
    with ThreadPoolExecutor(arguments.jobs) as pool:
        flights = plan(draw, arguments.flights, arguments.seed)
        list(pool.map(lambda flight: one(arguments, draw, flight), flights))
    text = table(arguments.work)
    (arguments.work / "table.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
