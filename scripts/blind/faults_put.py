"""Faults that users' logs have, put into good native logs. Each entry of FAULTS changes a Log in
place by random draws and returns what inspect must name: (finding ids, streams), any of them. Each
of BESIDE puts in an error that is no fault of these, and returns whether the log has a place for it."""
import numpy as np

import changes
from native import QUATERNION, about, inverse, product, turn

ACCEL, GYRO, PLACE = ("ax", "ay", "az"), ("gx", "gy", "gz"), ("x", "y", "z")
ATTITUDES = ("attitude", "mocap", "pose")
IMU_AXES = {"imu_axes", "accelerometer_axes", "body_axes", "body_up"}


def imu_by(log, matrix):
    for names in (ACCEL, GYRO):
        log.imu.set(names, log.imu.get(names) @ matrix.T)


def axes_swapped(log, rng):
    """x and y of the IMU exchanged, as by a wrong order of columns."""
    imu_by(log, np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]))
    return IMU_AXES, {"imu"}


def gyro_sign(log, rng):
    """One axis of the gyroscope with the other sign."""
    axis = rng.randrange(3)
    log.imu.columns[GYRO[axis]] *= -1.0
    return IMU_AXES, {"imu"}


def turned(log, rng):
    """The board turned by any angle from 20 to 180 deg about any axis."""
    axis = np.array([rng.gauss(0, 1) for _ in range(3)])
    q = about(axis / np.linalg.norm(axis), np.radians(rng.uniform(20, 180)))
    for names in (ACCEL, GYRO):
        log.imu.set(names, turn(q, log.imu.get(names)))
    return IMU_AXES, {"imu"}


def flu(log, rng):
    """The IMU in forward-left-up axes."""
    imu_by(log, np.diag([1.0, -1, -1]))
    return IMU_AXES, {"imu"}


def scale(log, rng):
    """The accelerometer reads 0.9 of the truth."""
    log.imu.set(ACCEL, 0.9 * log.imu.get(ACCEL))
    return {"accelerometer_scale"}, {"imu"}


def some_attitude(log, rng):
    return rng.choice([name for name in ATTITUDES if log.has(name)])


def clock(log, rng):
    """One stream stamped 1 s too late or too early."""
    stream = some_attitude(log, rng)
    log.streams[stream].delay(rng.choice([-1.0, 1.0]))
    return {"clock_offset"}, {stream}


def late(log, rng):
    """One stream late by 30 ms."""
    stream = some_attitude(log, rng)
    log.streams[stream].delay(0.030)
    return {"clock_offset"}, {stream}


def quaternion_order(log, rng):
    """x, y, z, w written where w, x, y, z is stated."""
    stream = some_attitude(log, rng)
    log.streams[stream].set(QUATERNION, log.streams[stream].get(QUATERNION)[:, [1, 2, 3, 0]])
    return {"quaternion_form"}, {stream}


def quaternion_inverse(log, rng):
    """The rotation from earth to body."""
    stream = some_attitude(log, rng)
    log.streams[stream].set(QUATERNION, inverse(log.streams[stream].get(QUATERNION)))
    return {"quaternion_form"}, {stream}


def earth_up(log, rng):
    """Positions and attitude of mocap in north-west-up."""
    stream = next((name for name in ("mocap", "pose") if log.has(name)), None)
    if stream is None:
        return None
    poses = log.streams[stream]
    poses.set(PLACE, poses.get(PLACE) * [1, -1, -1])
    flip = np.array([[0.0, 1, 0, 0]])
    poses.set(QUATERNION, product(np.broadcast_to(flip, (len(poses.t), 4)), poses.get(QUATERNION)))
    return {"earth_up", "position_axes"}, {stream}


def motors_permuted(log, rng):
    """Channels of rotors or motors in another order."""
    stream = next((name for name in ("rotors", "motors") if log.has(name)), None)
    if stream is None or not log.about.get("vehicle", {}).get("rotors"):
        return None
    names = list(log.streams[stream].columns)
    order = names[:]
    while order == names:
        rng.shuffle(order)
    log.streams[stream].set(names, log.streams[stream].get(order))
    return {"rotor_order"}, {stream}


def spins_reversed(log, rng):
    """Every spin of the vehicle turned round."""
    rotors = log.about.get("vehicle", {}).get("rotors")
    if not rotors or not (log.has("rotors") or log.has("motors")):
        return None
    for rotor in rotors:
        rotor["spin"] = -rotor["spin"]
    return {"rotor_spins_reversed"}, {"rotors", "motors"}


FAULTS = {f.__name__: f for f in (
    axes_swapped, gyro_sign, turned, flu, scale, clock, late, quaternion_order, quaternion_inverse,
    earth_up, motors_permuted, spins_reversed)}


def gate_moved(log, rng):
    """One gate of the map, so its fixes, moved by 0.4 m in any direction that is level."""
    if not log.has("fixes") or not log.about.get("gates"):
        return False
    heading = rng.uniform(0, 2 * np.pi)
    gate = rng.choice(log.about["gates"])["id"]
    changes.gate_moved(log, {"gate": gate, "dx": 0.4 * np.cos(heading), "dy": 0.4 * np.sin(heading), "dz": 0.0})
    return True


def tilt_scaled(log, rng):
    """The logged attitude leans by a quarter more."""
    if not log.has("attitude"):
        return False
    changes.tilt_scale(log, {"s": 0.25})
    return True


def fixes_late(log, rng):
    """Fixes late by 50 ms."""
    if not log.has("fixes"):
        return False
    log.fixes.delay(0.05)
    return True


BESIDE = {f.__name__: f for f in (gate_moved, tilt_scaled, fixes_late)}
