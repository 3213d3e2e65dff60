"""Trueline: from a drone's flight log to a calibrated model, with honest uncertainties.

    import trueline
    log = trueline.convert("flight.ulg")
    result = trueline.calibrate(log)
    print(result.verdict, result.parameters.K_x.value, result.parameters.K_x.sigma)
    result.plot().show()

Verbs are those of the command line, with its flags as arguments. A log is a folder or a `Log`,
which also takes NumPy arrays. Bad input raises `InputError`, with the command line's text; what
the command line warns of is a `TruelineWarning`.
"""
from ._trueline import InputError, NoUsableResult
from ._trueline import version as __version__
from .flight import STATE, replay, score, states
from .log import Log
from .result import Page, Record, Result
from .run import TruelineWarning, config
from .verbs import *  # noqa: F403: one function for each verb

__all__ = ["InputError", "Log", "NoUsableResult", "Page", "Record", "Result", "STATE",
           "TruelineWarning", "__version__", "replay", "score", "states", "audit", "benchmark",
           "calibrate", "config", "convert", "design", "diagnose", "export", "inspect", "observe", "simulate"]
