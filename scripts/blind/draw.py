"""Draws flights for the blind set: course, speed, vehicle, sensors, noise, turbulence and hidden
effects, all from one seed. Uses the simulator's physics and nothing of the estimators."""
import math
import random

import yaml

FOLDER = "simulate"  # of the configurations
DIAGNOSE = []        # flags of trueline-diagnose
COURSES = ["hippodrome", "iros2016", "fast"]

EFFECTS = {}         # by id, as `trueline effects` states them; run.py fills it


def draw_effect(rng, effect, least=0.0):
    """`least`: share of the range (of its logarithm) that is left out from below."""
    values = {}
    for name, (low, high, signed) in EFFECTS[effect].items():
        size = low * (high / low) ** rng.uniform(least, 1.0)  # log-uniform
        values[name] = int(size) if name == "gate" else size * (rng.choice([-1, 1]) if signed else 1)
    return {"id": effect, **values}


def draw_flight(config, seed, hidden):
    """`config`: a shipped configuration as a dict, changed in place. `hidden`: ids, or ["outside"].
    Returns what is hidden, for the seal."""
    rng = random.Random(seed)
    course = config["course"]
    factor = rng.uniform(0.85, 1.2)
    for part in [course, *course.get("corners", [])]:
        for key in ("speed", "turn_speed"):
            if key in part:
                part[key] = round(part[key] * factor, 3)
    config["vehicle"] = {"drag": [-rng.uniform(0.3, 0.8), -rng.uniform(0.3, 0.8), -0.1]}
    sigma = rng.choice([0.0, 0.03, 0.06, 0.1])
    config["turbulence"] = {"sigma": [sigma] * 3, "memory": rng.uniform(0.5, 1.5)}
    imu = config["imu"]
    imu["accel_bias"] = [rng.uniform(-0.15, 0.15), rng.uniform(-0.15, 0.15), rng.uniform(-0.3, 0.3)]
    imu["misalignment"] = [rng.uniform(-0.02, 0.02) for _ in range(3)]
    if rng.random() < 0.5:
        config["ahrs"] = {"kind": "drifting_error",
                          "constant": [rng.uniform(-0.02, 0.02) for _ in range(3)],
                          "drift_sigma": [rng.uniform(0.0, 0.006)] * 3,
                          "drift_memory": rng.uniform(10, 40)}
    detector = config.setdefault("detector", {})
    detector["sigma_factor"] = rng.choice([0.03, 0.05, 0.1])
    detector["fixes"] = rng.choice([[15, 20], [30, 45]])
    config["duration"] = 100
    least = 0.5 if len(hidden) > 1 else 0.0
    config["effects"] = [draw_effect(rng, e, least) for e in hidden if e in EFFECTS]
    if "outside" in hidden:
        return [hide_outside(rng, config)]
    return config["effects"]


def hide_outside(rng, config):
    """Something that no entry of the catalogue describes: a stormy flight, or what `spoil` does."""
    kinds = ["strong_gusts", "distance_squared"]
    if config["name"] != "hippodrome":  # two legs cannot separate one period a turn from two
        kinds.append("compass_twice_round")
    kind = rng.choice(kinds)
    hidden = {"id": f"outside:{kind}"}
    if kind == "strong_gusts":
        config["turbulence"] = {"sigma": [0.6, 0.6, 0.3], "memory": 2.0}
    elif kind == "compass_twice_round":
        hidden["phase"] = rng.uniform(0.25 * math.pi, 0.75 * math.pi)  # legs lie along the axes
    return hidden


def spoil(log, hidden):
    """Adds to the written log the hidden errors that the simulator lacks. `log`: its folder."""
    if hidden["id"] == "outside:compass_twice_round":
        rewrite(log / "attitude.csv", lambda row, at: turn_heading(row, at, hidden["phase"]))
    elif hidden["id"] == "outside:distance_squared":
        written = yaml.safe_load((log / "log.yaml").read_text())
        gates = {gate["id"]: gate["position"] for gate in written["gates"]}
        rewrite(log / "fixes.csv", lambda row, at: stretch(row, at, gates))


def rewrite(path, change):
    lines = path.read_text().splitlines()
    at = {name.split(" ")[0]: i for i, name in enumerate(lines[0].split(","))}
    rows = [",".join(change(line.split(","), at)) for line in lines[1:]]
    path.write_text("\n".join([lines[0], *rows]) + "\n")


def turn_heading(row, at, phase):
    """Heading too large by 0.15 rad sin(2 psi + phase): a rotation about z of E' before the
    attitude."""
    w, x, y, z = (float(row[at[n]]) for n in ("qw", "qx", "qy", "qz"))
    psi = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    half = 0.075 * math.sin(2 * psi + phase)
    c, s = math.cos(half), math.sin(half)
    for name, value in zip(("qw", "qx", "qy", "qz"),
                           (c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w)):
        row[at[name]] = f"{value:.9f}"
    return row


def stretch(row, at, gates):
    """Vectors to gates too long by 6 % for each metre of distance."""
    gate = gates[int(row[at["gate"]])]
    vector = [g - float(row[at[n]]) for g, n in zip(gate, "xyz")]
    factor = 1 + 0.06 * math.dist(vector, (0, 0, 0))
    for name, g, v in zip("xyz", gate, vector):
        row[at[name]] = f"{g - factor * v:.6f}"
    return row
