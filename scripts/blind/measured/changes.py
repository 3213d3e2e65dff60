"""Hides effects in a measured log: each is written from its definition (`trueline effects`), not
from the program's own corrections. `p`: its parameters. What a vehicle with that effect would have
logged, had it flown the same way, takes the place of what was logged.
"""
import functools
import random

import numpy as np

from native import (PLACE, QUATERNION, about, from_angles, inverse, product, resampled, turn)

ACCEL, GYRO = ("ax", "ay", "az"), ("gx", "gy", "gz")
REACH = 0.01        # s, to either side, over which rates are differentiated
REACH_PLACE = 0.15  # the same for positions, twice


def derivative(stream, names, reach=REACH):
    """By central differences over `reach`; one-sided at the ends."""
    step = round(reach * 1e9)
    later, earlier = np.minimum(stream.t + step, stream.t[-1]), np.maximum(stream.t - step, stream.t[0])
    span = np.maximum((later - earlier) * 1e-9, 1e-9)[:, None]
    return (resampled(stream, names, later) - resampled(stream, names, earlier)) / span


# Accelerometer

def accel_scale_z(log, p):
    log.imu.columns["az"] = (1 + p["s"]) * log.imu.columns["az"]


def accel_bias_drift(log, p):
    log.imu.columns["az"] = log.imu.columns["az"] + p["d"] * log.imu.seconds(log.start())


def imu_lever_arm(log, p):
    r = np.array([p["r_x"], p["r_y"], p["r_z"]])
    w, dw = log.imu.get(GYRO), derivative(log.imu, GYRO)
    log.imu.set(ACCEL, log.imu.get(ACCEL) + np.cross(w, np.cross(w, r)) + np.cross(dw, r))


def accel_bias(log, p):
    log.imu.set(ACCEL, log.imu.get(ACCEL) + np.array([p["x"], p["y"], p["z"]]))


# Attitude

def mocap_repeats_attitude(log):
    """True where the mocap of the log has no attitude of its own but that of the AHRS, maybe at stamps
    between its samples."""
    same = 5e-4  # rad
    if not log.has("mocap") or not log.has("attitude"):
        return False
    inside = (log.mocap.t >= log.attitude.t[0]) & (log.mocap.t <= log.attitude.t[-1])
    if np.count_nonzero(inside) < 10:
        return False
    copy = resampled(log.attitude, QUATERNION, log.mocap.t[inside])
    apart = product(inverse(copy), log.mocap.get(QUATERNION)[inside])
    return np.median(2 * np.linalg.norm(apart[:, 1:], axis=1)) < same


def of_attitude(change):
    """A change of the AHRS's attitude, which mocap repeats where it did so before."""
    @functools.wraps(change)
    def changed(log, p):
        copied = mocap_repeats_attitude(log)
        change(log, p)
        if copied:
            log.mocap.set(QUATERNION, resampled(log.attitude, QUATERNION, log.mocap.t))
    return changed


def turn_earth(stream, phi, theta, psi):
    """Turns the AHRS's earth E' by these angles (arrays, rad) against E."""
    stream.set(QUATERNION, product(inverse(from_angles(phi, theta, psi)), stream.get(QUATERNION)))


def heading(stream):
    forward = turn(stream.get(QUATERNION), np.tile([1.0, 0.0, 0.0], (len(stream.t), 1)))
    return np.arctan2(forward[:, 1], forward[:, 0])


@of_attitude
def heading_drift(log, p):
    none = np.zeros(len(log.attitude.t))
    turn_earth(log.attitude, none, none, p["d"] * log.attitude.seconds(log.start()))


@of_attitude
def heading_distortion(log, p):
    none, psi = np.zeros(len(log.attitude.t)), heading(log.attitude)
    turn_earth(log.attitude, none, none, p["a_sin"] * np.sin(psi) + p["a_cos"] * np.cos(psi))


@of_attitude
def tilt_scale(log, p):
    """Turns further about the level axis about which the body already leans."""
    q = log.attitude.get(QUATERNION)
    down = turn(q, np.tile([0.0, 0.0, 1.0], (len(q), 1)))
    level = np.hypot(down[:, 0], down[:, 1])
    axis = np.stack([-down[:, 1], down[:, 0], 0 * level], axis=1) / np.maximum(level, 1e-12)[:, None]
    log.attitude.set(QUATERNION, product(about(axis, p["s"] * np.arctan2(level, down[:, 2])), q))


@of_attitude
def attitude_latency(log, p):
    log.attitude.delay(p["tau"])


def motion(log, at):
    """Velocity and acceleration in E at stamps `at`, from mocap's positions; zero in its outages."""
    step = round(REACH_PLACE * 1e9)
    before, here, after = (resampled(log.mocap, PLACE, at + k * step) for k in (-1, 0, 1))
    values = (after - before) / (2 * REACH_PLACE), (before - 2 * here + after) / REACH_PLACE**2
    outages = np.concatenate([[0], np.cumsum(np.diff(log.mocap.t) > 2 * step)])  # up to each row
    last = len(outages) - 1
    begin = np.clip(np.searchsorted(log.mocap.t, at - step, "right") - 1, 0, last)
    end = np.clip(np.searchsorted(log.mocap.t, at + step), 0, last)
    inside = (at - step >= log.mocap.t[0]) & (at + step <= log.mocap.t[-1])
    covered = inside & (outages[begin] == outages[end])
    return tuple(np.where(covered[:, None], value, 0.0) for value in values)


def acceleration(log, at):
    return motion(log, at)[1]


@of_attitude
def ahrs_drag_error(log, p):
    """The tilt of E' goes to that of the deceleration k v, by a filter of positions without drag."""
    t, gravity, poles = log.attitude.t, log.about.get("gravity", 9.81), 2.5
    dt, drag = np.diff(t, prepend=t[0]) * 1e-9, p["k"] * motion(log, t)[0][:, :2]
    position, velocity, fed_back = np.zeros(2), np.zeros(2), np.zeros((len(t), 2))
    for i in range(1, len(t)):
        fed_back[i] = fed_back[i - 1] - dt[i] * poles**3 * position
        velocity += dt[i] * (fed_back[i] + drag[i] - 2 * poles**2 * position)
        position += dt[i] * (velocity - 2 * poles * position)
    turn_earth(log.attitude, -fed_back[:, 1] / gravity, fed_back[:, 0] / gravity, np.zeros(len(t)))


@of_attitude
def ahrs_acceleration_error(log, p):
    """The tilt of E' goes to (a_y, -a_x) / g, low-passed with gain k."""
    t = log.attitude.t
    a, gravity = acceleration(log, t), log.about.get("gravity", 9.81)
    passed = 1 - np.exp(-p["k"] * np.diff(t, prepend=t[0]) * 1e-9)
    tilt = np.zeros((len(t), 2))
    for i in range(1, len(t)):
        apparent = np.array([a[i, 1], -a[i, 0]]) / gravity
        tilt[i] = tilt[i - 1] + passed[i] * (apparent - tilt[i - 1])
    turn_earth(log.attitude, tilt[:, 0], tilt[:, 1], np.zeros(len(tilt)))


# Fixes: a fix is the gate's place on the map less the measured vector to the gate.

def of_gates(log, gate=-1):
    """Rows of fixes of gates of the map (-1), or of one of them."""
    known = {entry["id"] for entry in log.about["gates"]} if gate < 0 else {gate}
    return np.isin(log.fixes.columns["gate"], list(known))


def change_vectors(log, change):
    """Replaces the measured vectors in E by change(rows of fixes, vectors)."""
    rows = of_gates(log)
    places = np.array([log.gate(int(g))["position"] for g in log.fixes.columns["gate"][rows]])
    fixes = log.fixes.get(PLACE)
    fixes[rows] = places - change(rows, places - fixes[rows])
    log.fixes.set(PLACE, fixes)


def fix_latency(log, p):
    log.fixes.delay(p["tau"])


def fix_scale(log, p):
    change_vectors(log, lambda rows, vectors: (1 + p["s"]) * vectors)


def camera_misalignment(log, p):
    def misaligned(rows, vectors):
        q = resampled(log.mocap if log.has("mocap") else log.attitude, QUATERNION, log.fixes.t[rows])
        angles = (np.full(len(vectors), p[name]) for name in ("roll", "pitch", "yaw"))
        return turn(product(q, from_angles(*angles)), turn(inverse(q), vectors))

    change_vectors(log, misaligned)


def gate_moved(log, p):
    """The gate stands where it stood: the map is wrong, and with it the fixes of that gate."""
    d = np.array([p["dx"], p["dy"], p["dz"]])
    entry = log.gate(p["gate"])
    entry["position"] = [float(x) for x in np.array(entry["position"], dtype=float) - d]
    shift_fixes(log, of_gates(log, p["gate"]), d)


def shift_fixes(log, rows, d):
    fixes = log.fixes.get(PLACE)
    fixes[rows] -= d
    log.fixes.set(PLACE, fixes)


def passes(log, gate, gap=0.7):
    """Rows of fixes by pass of this gate."""
    rows = np.flatnonzero(of_gates(log, gate))
    cuts = np.flatnonzero(np.diff(log.fixes.t[rows]) * 1e-9 > gap) + 1
    return np.split(rows, cuts)


def false_gate(log, p):
    """An object at d from the gate (-1: from any) is seen instead of it, in whole passes or now and
    then. States in `p` the share of all fixes that this came to."""
    rng = random.Random(p["pick"])
    groups = passes(log, p["gate"])
    wanted, most = p["fraction"] * len(log.fixes.t), 0.4 * sum(map(len, groups))
    if not p["whole_passes"] or min(map(len, groups)) > most:
        groups = [[row] for group in groups for row in group]
    rng.shuffle(groups)
    rows = []
    for group in groups:
        if len(rows) < wanted and len(rows) + len(group) <= most:
            rows.extend(group)
    p["fraction"] = len(rows) / len(log.fixes.t)
    shift_fixes(log, rows, np.array([p["dx"], p["dy"], p["dz"]]))


# Rotor speeds: the vehicle flew as it did, so its thrust is that of the true speeds; what is
# logged is the speed that would have given it, were the effect there.

def speeds(log):
    return tuple(log.rotors.columns)


def rotor_loss(log, p):
    name = speeds(log)[p["rotor"]]
    log.rotors.columns[name] = log.rotors.columns[name] / np.sqrt(p["factor"])


def thrust_sag(log, p):
    left = 1 - p["d"] * log.rotors.seconds(log.start())
    for name in speeds(log):
        log.rotors.columns[name] = log.rotors.columns[name] / np.sqrt(left)


def motor_lag(log, p):
    """The command that a first-order lag of tau turns into the measured speed."""
    change = derivative(log.rotors, speeds(log), reach=0.02)
    log.rotors.set(speeds(log), log.rotors.get(speeds(log)) + p["tau"] * change)


def speeds_late(log, p):
    log.rotors.delay(p["tau"])


def poses_late(log, p):
    log.mocap.delay(p["tau"])


def pose_sensor_moved(log, p):
    r = np.tile([p["x"], p["y"], p["z"]], (len(log.mocap.t), 1))
    log.mocap.set(PLACE, log.mocap.get(PLACE) + turn(log.mocap.get(QUATERNION), r))


def imu_moved(log, p):
    imu_lever_arm(log, {f"r_{axis}": p[axis] for axis in PLACE})


CHANGES = {change.__name__: change for change in (
    accel_scale_z, accel_bias_drift, imu_lever_arm, accel_bias, heading_drift, heading_distortion,
    tilt_scale, attitude_latency, ahrs_drag_error, ahrs_acceleration_error, fix_latency, fix_scale,
    camera_misalignment, gate_moved, false_gate, rotor_loss, thrust_sag, motor_lag, speeds_late,
    poses_late, pose_sensor_moved, imu_moved)}
