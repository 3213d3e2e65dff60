"""Flights of a rotor-driven model by rotor speeds, and their errors."""
import os
from pathlib import Path
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _trueline
from .result import Array, Table
from .run import _text

File = Union[str, os.PathLike[str]]
# t [s]; attitude, body to NED; position [m] and velocity [m/s] in E; rates [rad/s] in the body.
STATE = np.dtype([(name, float) for name in
                  "t qw qx qy qz x y z vx vy vz wx wy wz".split()])
ERRORS = np.dtype([(name, float) for name in ("t", "p", "v", "R", "w")])


def _structured(rows: Array, dtype: Any) -> Table:
    return np.rec.fromarrays(list(np.asarray(rows).T), dtype=dtype)


def _plain(states: Array) -> Array:
    return np.column_stack([states[name] for name in STATE.names or ()])


def _file(model: File) -> str:
    return _text("model", model, Path())


def states(log: File, model: Optional[File] = None) -> Table:
    """The states that a log measures, at its poses: their positions and attitudes, velocities by
    differences over 0.1 s, rates by the gyroscope. With `model` (model.yaml, or a result) places
    and biases of the sensors are taken off; without it they count as none. Rotor speeds must be in
    the log."""
    rows, _, _ = _trueline.measured(os.fspath(log), _file(model) if model is not None else "")
    return _structured(rows, STATE)


def replay(model: File, log: Union[File, Array], *, start: float = 0.0, seconds: float = 1.0,
           state: Optional[Array] = None, t: Optional[Array] = None,
           commands: bool = False) -> Table:
    """Flies the model open loop by rotor speeds; returns states (dtype `STATE`).

    model: model.yaml of a calibration with drive="rotors", the result itself, or a parameter file
    of a simulator that `trueline.audit` reads.
    log: a log with rotor speeds. The flight starts at the measured state `start` seconds after its
    first one, and returns the states at the poses' times over `seconds`. Or an array of samples x
    (time [s], speed of each rotor [rad/s]): it starts at its first sample from `state` (of dtype
    `STATE`) and returns the states at `t`, which are the samples' times where it is not given.
    commands: the speeds are commands, which the motors follow with the model's lag.
    """
    if isinstance(log, np.ndarray):
        if state is None:
            raise _trueline.InputError("replay: an array of rotor speeds needs `state`, where to start from")
        speeds, times = np.atleast_2d(log), np.asarray(log[:, 0] if t is None else t, float)
        speed_times, speeds = speeds[:, 0], speeds[:, 1:]
        first = _plain(np.atleast_1d(state))[0]
    else:
        rows, speed_times, speeds = map(np.asarray, _trueline.measured(os.fspath(log), _file(model)))
        since = rows[:, 0] - rows[0, 0]
        part = rows[(since >= start) & (since <= start + seconds)]
        if len(part) < 2:
            raise _trueline.InputError(f"replay: the log has no poses from {start} s on, of {since[-1]:.3f} s")
        times, first = part[:, 0], part[0]
    flown = _trueline.replay(_file(model), first[1:], list(times), list(speed_times),
                             np.asarray(speeds, float), commands)
    return _structured(flown, STATE)


def score(predicted: Array, measured: Array) -> Tuple[Table, Table]:
    """Errors of predicted states at their own times: position [m], velocity [m/s], attitude [rad]
    and rates [rad/s], as columns t, p, v, R, w, and their means. The measured states (dtype
    `STATE`) are interpolated; predictions outside of their time are left out."""
    truth = _plain(measured)
    given = _plain(predicted)
    given = given[(given[:, 0] >= truth[0, 0]) & (given[:, 0] <= truth[-1, 0])]
    if len(given) == 0:
        raise _trueline.InputError("score: no prediction lies within the measured time")
    turns = np.sign(np.sum(truth[1:, 1:5] * truth[:-1, 1:5], axis=1))  # q and -q are one attitude
    truth[1:, 1:5] *= np.cumprod(np.where(turns < 0, -1.0, 1.0))[:, None]
    at = np.column_stack([np.interp(given[:, 0], truth[:, 0], truth[:, k]) for k in range(14)])
    at[:, 1:5] /= np.linalg.norm(at[:, 1:5], axis=1, keepdims=True)
    given[np.sum(at[:, 1:5] * given[:, 1:5], axis=1) < 0, 1:5] *= -1.0
    order = [5, 6, 7, 8, 9, 10, 1, 2, 3, 4, 11, 12, 13]  # p, v, q, w
    errors = np.column_stack([given[:, 0], _trueline.errors(given[:, order], at[:, order])])
    return _structured(errors, ERRORS), _structured(errors.mean(axis=0)[None, :], ERRORS)[0]
