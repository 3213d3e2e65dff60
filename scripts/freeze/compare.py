"""Compares records decision by decision."""
import math
from collections import Counter
from dataclasses import dataclass, field

MOVED = 0.5         # sigmas that an estimate may move
SIGMA_RATIO = 1.10  # factor by which its sigma may change
ERROR = 0.03        # share by which an error may change,
ERROR_M = 0.0005    # or so many metres
STEP = 0.2          # s by which the time of a step may change
SPEED = 1.15        # factor beyond which a speed is flagged
GROUPS = {"parameters": "estimate", "whole": "estimate", "errors": "error", "counts": "word",
          "speeds": "speed"}


@dataclass
class Change:
    flight: str
    what: str
    was: object
    now: object
    note: str = ""


@dataclass
class Comparison:
    same: int = 0
    changed: list = field(default_factory=list)
    slower: list = field(default_factory=list)  # or quicker: speeds that differ


def labels(causes):
    """A name for each cause: its id, numbered where two have the same."""
    seen, names = Counter(), []
    for cause in causes:
        seen[cause["id"]] += 1
        count = seen[cause["id"]]
        names.append(cause["id"] + (f" {count}" if count > 1 else ""))
    return names


def cause_leaves(causes):
    yield "causes", ("word", [cause["id"] for cause in causes])
    for label, cause in zip(labels(causes), causes):
        yield f"{label}.confirmed", ("word", cause.get("confirmed", "not asked"))
        yield f"{label}.confused_with", ("word", sorted(cause["confused_with"]))
        for name, value in cause["parameters"].items():
            yield f"{label}.{name}", ("estimate", value)
        for name in ("gain", "gain_open_loop"):
            if name in cause:
                yield f"{label}.{name}", ("error", cause[name])


def leaves(record):
    """(name, (kind, value)) of each decision."""
    for key, value in record.items():
        if key == "causes":
            yield from cause_leaves(value)
        elif key in GROUPS:
            for name, item in value.items():
                yield f"{key}.{name}", (GROUPS[key], item)
        else:
            yield key, ("word", value)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def moved(was, now):
    """(sigmas by which an estimate moved, ratio of the sigmas)."""
    (value, sigma), (value_now, sigma_now) = was[:2], now[:2]
    if not sigma or not sigma_now:
        same = value == value_now and sigma == sigma_now
        return (0.0, 1.0) if same else (math.inf, math.inf)
    return abs(value_now - value) / sigma, sigma_now / sigma


def same_estimate(name, was, now):
    if not isinstance(was, list) or not isinstance(now, list):  # a choice: a gate, a rotor, a time
        if name.endswith("t_step") and is_number(was) and is_number(now):
            return abs(now - was) <= STEP, f"by {now - was:+.2f} s"
        return was == now, ""
    sigmas, ratio = moved(was, now)
    note = f"moved {sigmas:.2f} sigmas, sigma x {ratio:.2f}"
    return sigmas <= MOVED and 1 / SIGMA_RATIO <= ratio <= SIGMA_RATIO and was[2:] == now[2:], note


def near(was, now):
    if not is_number(was) or not is_number(now):
        return was == now
    return abs(now - was) <= max(ERROR * abs(was), ERROR_M)


def change_in_percent(was, now):
    return ", ".join(f"{100 * (n / w - 1):+.0f} %" for w, n in zip(was, now)
                     if is_number(w) and is_number(n) and w)


def same_error(was, now):
    was, now = ([x] if not isinstance(x, list) else x for x in (was, now))
    same = len(was) == len(now) and all(near(w, n) for w, n in zip(was, now))
    return same, change_in_percent(was, now)


def same_speed(was, now):
    ratio = now / was if was else math.inf
    return 1 / SPEED <= ratio <= SPEED, f"x {ratio:.2f}"


def same(kind, name, was, now):
    """(whether the decision is the same, by how much it differs)."""
    if was is None or now is None:
        return was == now, ""
    if kind == "estimate":
        return same_estimate(name, was, now)
    if kind == "error":
        return same_error(was, now)
    return same_speed(was, now) if kind == "speed" else (was == now, "")


def of_other_causes(was, now):
    """Names of the causes that only one of the two names: `causes` tells of them."""
    both = [set(labels(record.get("causes", []))) for record in (was, now)]
    return both[0] ^ both[1]


def compare_record(flight, was, now, comparison):
    alone = of_other_causes(was, now)
    before, after = dict(leaves(was)), dict(leaves(now))
    for name in dict.fromkeys([*before, *after]):
        if name.split(".")[0] in alone:
            continue
        kind = (before.get(name) or after[name])[0]
        values = [side.get(name, (kind, None))[1] for side in (before, after)]
        equal, note = same(kind, name, *values)
        if equal:
            comparison.same += name != "hidden"  # what is drawn is no decision
        else:
            into = comparison.slower if kind == "speed" else comparison.changed
            into.append(Change(flight, name, *values, note))


def compare(was, now):
    """Of two mappings of records by flight."""
    comparison = Comparison()
    for flight in dict.fromkeys([*was, *now]):
        if flight not in was or flight not in now:
            there = ["there" if flight in side else "missing" for side in (was, now)]
            comparison.changed.append(Change(flight, "flight", *there))
        else:
            compare_record(flight, was[flight], now[flight], comparison)
    return comparison
