#!/usr/bin/python3
"""Simulates flights of many vehicles, three of which have a defect, and writes their table.

    simulate_fleet.py --out=/tmp/fleet --vehicles=20 --flights=60 [--apps=build/apps] [--seed=1]

Writes OUT/flights.csv, OUT/logs/FLIGHT and OUT/defects.yaml (what merge.py should name): a camera
that is misaligned, drag that grows with the date, an accelerometer whose bias is too large. Logs that
are in OUT already are not flown again.
"""
import argparse
import csv
import datetime
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

SOURCE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(SOURCE / "scripts/freeze"))
from program import clear_left_over, refuse_other_draw

DEFECTS = ["camera misaligned", "drag grows", "accelerometer bias"]
DRAW = ("seed", "vehicles", "flights")
DAYS = 90
SECONDS = 60


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--vehicles", type=int, default=20)
    parser.add_argument("--flights", type=int, default=60)
    parser.add_argument("--apps", type=Path, default=SOURCE / "build/apps")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    if arguments.vehicles < len(DEFECTS):
        parser.error(f"--vehicles: {len(DEFECTS)} or more, since as many have a defect")
    return arguments


def draw_vehicle(draw):
    return {"drag": [-draw.gauss(0.5, 0.05), -draw.gauss(0.55, 0.05), -0.1],
            "accel_bias": [draw.gauss(0, 0.08), draw.gauss(0, 0.08), draw.gauss(0, 0.1)],
            "misalignment": [draw.gauss(0, 0.008) for _ in range(3)]}


def configuration(base, vehicle, defect, share, draw):
    """One flight; `share` (0 to 1) is how much of the time has passed."""
    config = dict(yaml.safe_load(base), duration=SECONDS)
    factor = 1.8 if defect == "drag grows" and share > 0 else 1.0
    drag = [k * (1.0 + (factor - 1.0) * share) for k in vehicle["drag"]]
    config["vehicle"] = {"drag": drag}
    bias = list(vehicle["accel_bias"])
    if defect == "accelerometer bias":
        bias[0] += 0.9
    config["imu"].update(rate=200.0, misalignment=vehicle["misalignment"],
                         accel_bias=[b + draw.gauss(0, 0.01) for b in bias])
    config["turbulence"]["sigma"] = [draw.choice([0.02, 0.04, 0.06])] * 3
    if defect == "camera misaligned":
        config["effects"] = [{"id": "camera_misalignment", "roll": 0.05, "pitch": 0.12,
                              "yaw": -0.1}]
    return config


def main():
    arguments = parse_arguments()
    draw = random.Random(arguments.seed)
    base = (SOURCE / "config/simulate/iros2016.yaml").read_text()
    names = [f"quad{k:02d}" for k in range(1, arguments.vehicles + 1)]
    vehicles = {name: draw_vehicle(draw) for name in names}
    defects = dict(zip(draw.sample(names, len(DEFECTS)), DEFECTS))
    for folder in ("logs", "configs"):
        (arguments.out / folder).mkdir(parents=True, exist_ok=True)
    refuse_other_draw(arguments.out, {name: getattr(arguments, name) for name in DRAW})
    (arguments.out / "defects.yaml").write_text(yaml.safe_dump(defects))
    rows, commands = [], []
    for number in range(arguments.flights):
        name = names[number % len(names)]
        share = (number // len(names)) / max(1, (arguments.flights - 1) // len(names))
        date = datetime.date(2024, 3, 1) + datetime.timedelta(days=round(share * DAYS))
        flight = f"{name}_{number // len(names):03d}"
        config = arguments.out / "configs" / f"{flight}.yaml"
        config.write_text(yaml.safe_dump(
            configuration(base, vehicles[name], defects.get(name), share, draw)))
        log = arguments.out / "logs" / flight
        rows.append([flight, name, date.isoformat(), str(log)])
        clear_left_over(log)
        if not log.exists():
            commands.append([arguments.apps / "trueline-simulate", f"--config={config}",
                             f"--out={log}", f"--seed={number + 1}", "--quiet"])
    with open(arguments.out / "flights.csv", "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["flight", "vehicle", "date", "log"], *rows])
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for done in pool.map(lambda c: subprocess.run(c, check=True), commands):
            del done


if __name__ == "__main__":
    main()
