"""Draws what is hidden in a measured flight: an effect and its size, as a multiple of what the
diagnosis of the untouched flight calls detectable."""
import math

from judge import times_detectable

LEAST, COUNTED, MOST = 0.5, 2.0, 4.0  # times the detectable size; from COUNTED on it should be named
NEEDS = {  # streams, or a map of gates, that a change needs; by drive, in the order of their turns
    "imu": {"accel_scale_z": ["imu"], "fix_latency": ["fixes"], "attitude_latency": ["attitude"],
            "imu_lever_arm": ["imu"], "gate_moved": ["fixes", "gates"], "tilt_scale": ["attitude"],
            "accel_bias_drift": ["imu"], "fix_scale": ["fixes", "gates"],
            "heading_distortion": ["attitude"], "false_gate": ["fixes", "gates"],
            "ahrs_acceleration_error": ["attitude", "mocap"],
            "ahrs_drag_error": ["attitude", "mocap"],
            "camera_misalignment": ["fixes", "gates", "mocap"], "heading_drift": ["attitude"],
            "accel_bias": ["imu"]},
    "rotors": {"rotor_loss": ["rotors"], "thrust_sag": ["rotors"], "motor_lag": ["rotors"],
               "poses_late": ["mocap"], "speeds_late": ["rotors"], "pose_sensor_moved": ["mocap"],
               "imu_moved": ["imu"]}}
# Largest sizes where the declaration's, meant for made flights of 100 s, are too small or missing.
LARGEST = {"accel_bias_drift": {"d": 0.03}, "heading_drift": {"d": 0.03}, "tilt_scale": {"s": 0.3}}
SIGNED = {"tilt_scale", "rotor_loss"}
# What the calibrated model itself describes, so that no cause shall be named: largest sizes, and the
# prior of the rotor drive's configuration that must leave it free.
ABSORBED = {"accel_bias": ({"x": 0.3, "y": 0.3, "z": 0.3}, None),
            "poses_late": ({"tau": 0.015}, "pose_delay"), "speeds_late": ({"tau": 0.015}, None),
            "pose_sensor_moved": ({"x": 0.015, "y": 0.015, "z": 0.015}, "r_BP_x"),
            "imu_moved": ({"x": 0.006, "y": 0.006, "z": 0.0}, "r_BI_x")}
UNSIGNED = {"poses_late", "speeds_late"}


def sign(rng, either):
    return rng.choice([-1, 1]) if either else 1


def direction(rng, size):
    """Shares of that many parameters, with a sum of squares of 1."""
    shares = [abs(rng.gauss(0, 1)) for _ in range(size)]
    return [share / math.hypot(*shares) for share in shares]


def draw_sizes(rng, from_counted, detectable, largest):
    """{parameter: size > 0}, together log-uniform below or from COUNTED detectable sizes on; None
    where plausible sizes do not reach that. A parameter that hardly shows is left out."""
    low, high = (COUNTED, MOST) if from_counted else (LEAST, COUNTED)
    ratios = {name: largest[name] / size for name, size in detectable.items()}
    shown = [name for name, ratio in ratios.items() if ratio >= LEAST]
    for _ in range(50 if shown else 0):
        shares = dict(zip(shown, direction(rng, len(shown))))
        most = min(high, *(ratios[name] / share for name, share in shares.items()))
        if most > low:
            times = low * (most / low) ** rng.random()
            return {name: times * share * detectable[name] for name, share in shares.items()}
    return None


def draw_absorbed(rng, effect, config):
    largest, prior = ABSORBED[effect]
    if prior and config.get("prior", {}).get(prior) in (None, 0):
        return None
    return {"id": effect, **{name: size * rng.uniform(0.3, 1.0) * sign(rng, effect not in UNSIGNED)
                             for name, size in largest.items()}}


def draw_index(candidate, about, effect):
    """Of a gate or rotor that the candidate is about: the last word of its name."""
    names = {"gate_moved": "gate", "rotor_loss": "rotor"}
    if effect not in names:
        return {}
    only = about["gates"][0]["id"] if effect == "gate_moved" else 0
    return {names[effect]: int(candidate["which"].split()[-1]) if "which" in candidate else only}


def draw_object(rng, drawn, gates):
    """Of a false gate: where it stands, and in which fixes it is seen."""
    place = {name: sign(rng, True) * drawn[name][0] * (drawn[name][1] / drawn[name][0]) ** rng.random()
             for name in ("dx", "dy", "dz")}
    return {"gate": rng.choice([-1, *gates]), **place, "whole_passes": rng.random() < 0.5,
            "pick": rng.randrange(10**9)}


def draw_effect(rng, effect, from_counted, drawn, diagnosis, about):
    """`drawn`: {parameter: (low, high, either sign)} of the declaration. None where no plausible size
    of the effect would show so well on this flight."""
    candidates = [c for c in diagnosis["candidates"] if c["id"] == effect and "detectable_size" in c]
    if not candidates:
        return None
    candidate = rng.choice(candidates)
    detectable = candidate["detectable_size"]
    largest = {name: 1 - low if name == "factor" else high for name, (low, high, _) in drawn.items()}
    sizes = draw_sizes(rng, from_counted, detectable, {**largest, **LARGEST.get(effect, {})})
    if sizes is None:
        return None
    hidden = {"id": effect, **draw_index(candidate, about, effect)}
    for name in detectable:
        either = effect in SIGNED or drawn.get(name, (0, 0, False))[2]
        hidden[name] = sizes.get(name, 0.0) * sign(rng, either) + (name == "factor")
    if effect == "false_gate":
        hidden |= draw_object(rng, drawn, [gate["id"] for gate in about["gates"]])
    return hidden


def can_show(effect, drive, log, about):
    """True if the log's folder has what the change needs."""
    return all(about.get("gates") if need == "gates" else (log / f"{need}.csv").exists()
               for need in NEEDS[drive][effect])


def times(hidden, diagnosis):
    """Size in detectable sizes of the untouched flight, of that gate or rotor."""
    index = [f"{hidden['id']} {hidden[name]}" for name in ("gate", "rotor") if name in hidden]
    of_it = [c for c in diagnosis["candidates"] if c["id"] == hidden["id"] and "detectable_size" in c
             and (not index or c.get("which", index[0]) == index[0])]
    return times_detectable(hidden, {"candidates": of_it})
