"""Draws rotor-driven flights for the blind set: vehicle, trajectory, sensors, noise and hidden
effects, all from one seed. The vehicle differs from the nominal one that the diagnosis gets."""
import random

from draw import rewrite, turn_heading

FOLDER = "rotors"
COURSES = ["random"]
DIAGNOSE = ["--drive=rotors", "--config={source}/config/calibrate/rotors.yaml"]

EFFECTS = {}  # by id, as `trueline effects` states them; run.py fills it
POOR = {"sigma_accel": 2.2, "sigma_gyro": 0.1732, "sigma_position": 0.01, "sigma_attitude": 0.01,
        "force_density": 0.1, "angular_density": 0.5}
GOOD = {"sigma_accel": 0.4, "sigma_gyro": 0.03, "sigma_position": 0.003, "sigma_attitude": 0.005,
        "force_density": 0.05, "angular_density": 0.3}


def draw_effect(rng, effect):
    values = {}
    for name, (low, high, signed) in EFFECTS[effect].items():
        if name == "rotor":
            values[name] = rng.randint(int(low), int(high))
            continue
        size = low * (high / low) ** rng.random()
        values[name] = size * (rng.choice([-1, 1]) if signed else 1)
    return {"id": effect, **values}


def draw_vehicle(rng, vehicle):
    vehicle["mass"] *= rng.uniform(0.9, 1.1)
    vehicle["inertia"] = [i * rng.uniform(0.9, 1.1) for i in vehicle["inertia"]]
    for arm, spread in (("r_BM", 0.005), ("r_BP", 0.03), ("r_BI", 0.01)):
        vehicle[arm] = [x + rng.uniform(-spread, spread) for x in vehicle[arm]]
    vehicle["r_BI"][2] = 0.0  # known: not distinguishable from the other lever arms


def draw_flight(config, seed, hidden):
    """`config`: a shipped configuration as a dict, changed in place. `hidden`: ids, or ["outside"].
    Returns what is hidden, for the seal."""
    rng = random.Random(seed)
    draw_vehicle(rng, config["vehicle"])
    config["biases"] = {"accel": [rng.uniform(-0.3, 0.3) for _ in range(3)],
                        "gyro": [rng.uniform(-0.03, 0.03) for _ in range(3)]}
    config["limits"]["travel"] = rng.choice([1.0, 2.0])
    config["trajectory"] = {"kind": "random", "duration": rng.choice([12, 15, 20]), "seed": seed}
    simulation = config["simulation"]
    simulation["height"] = config["limits"]["travel"] + rng.uniform(0.1, 0.4)
    noise = rng.choice([POOR, GOOD])
    simulation["noise"] = {name: value * rng.uniform(0.7, 1.4) for name, value in noise.items()}
    simulation["motor_lag"] = rng.uniform(0.01, 0.03)
    simulation["effects"] = [draw_effect(rng, e) for e in hidden if e in EFFECTS]
    simulation["log_commands"] = "motor_lag" in hidden  # measured speeds have no lag
    if "outside" in hidden:
        return [hide_outside(rng, config)]
    return simulation["effects"]


def hide_outside(rng, config):
    """Something that no entry of the catalogue describes, large enough to be detected."""
    simulation = config["simulation"]
    kind = rng.choice(["strong_gusts", "heading_twice_round", "accelerometer_scale"])
    if kind == "strong_gusts":
        simulation["noise"]["force_density"] = 0.8
    elif kind == "accelerometer_scale":
        simulation["effects"] = [{"id": "accel_scale_z", "s": 0.2}]
    return {"id": f"outside:{kind}"}


def spoil(log, hidden):
    """Adds to the written log the hidden errors that the simulator lacks. `log`: its folder."""
    if hidden["id"] == "outside:heading_twice_round":
        rewrite(log / "pose.csv", lambda row, at: turn_heading(row, at, 0.0))
