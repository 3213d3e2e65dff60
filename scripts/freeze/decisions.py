"""What the result files of a folder decide, and how the decisions of two folders differ."""
import math
import re
from collections import Counter
from dataclasses import dataclass, field

from judge import tallies
from program import read_yaml

MOVED = 0.5         # sigmas that an estimate may move
SIGMA_RATIO = 1.10  # factor by which its sigma may change
ERROR = 0.03        # share by which a number may change,
ERROR_M = 0.0005    # or so many metres
STEP = 0.2          # s by which the time of a step may change
SPEED = 1.15        # factor beyond which a speed is flagged
# Keys of each result file that decide something, and keys below them that don't.
OF = {"diagnosis": ("verdict", "causes", "set_aside", "goes_with", "gain", "gain_open_loop", "misfit"),
      "calibration": ("verdict", "parameters", "whole_flight", "arcs", "open_loop"), "summary": ("groups",),
      "coverage": None, "outcome": ("exit",), "speed": None}
NO_DECISION = {"arcs", "because", "confidence", "evidence", "flights", "inside_50", "interval95", "iterations",
               "mean_in_sigmas", "measured_by", "other_flights", "passes", "physics", "rank_band_95", "rank_distance",
               "replays", "rms_body_m", "seconds", "separate_by", "share_of_variance", "strengths", "unit", "witness"}
NAMES = ("id", "log", "label", "gamma", "sweep", "horizon", "horizon_s")  # of an item of a list
NUMBER = re.compile(r"\d+(\.\d+)?")  # what goes with the misfit is named with its size


@dataclass
class Comparison:
    same: int = 0
    changed: list = field(default_factory=list)  # of (flight, what, was, now, note)
    speeds: list = field(default_factory=list)   # that differ


def labels(items):
    """A name for each item of a list, numbered where two have the same."""
    seen, names = Counter(), []
    for item in items:
        name = " ".join(str(item[key]) for key in NAMES if key in item)
        seen[name] += 1
        names.append(name + (f" {seen[name]}" if seen[name] > 1 else ""))
    return names


def leaves(node, name):
    """(name, decision): an estimate is (value, sigma, status)."""
    if isinstance(node, dict) and "value" in node:
        yield name, (node["value"], node.get("sigma"), node.get("status"))
    elif isinstance(node, dict):
        for key, item in node.items():
            if key not in NO_DECISION:
                yield from leaves(item, f"{name}.{key}")
    elif isinstance(node, list) and node and isinstance(node[0], dict):
        yield name, labels(node)
        for label, item in zip(labels(node), node):
            yield from leaves(item, f"{name}.{label}")
    else:
        yield name, node


def decisions_of(file):
    node = read_yaml(file)
    if file.stem == "diagnosis":
        node["set_aside"] = [cause["id"] for cause in node.get("set_aside") or []]
        node["goes_with"] = sorted(NUMBER.sub("N", what) for what in node.get("goes_with") or [])
    keys = [key for key in OF[file.stem] or node if key in node]
    found = {name: decision for key in keys for name, decision in leaves(node[key], key)}
    sealed = file.parents[2] / "sealed" / f"{file.parent.name}.hidden.yaml"
    if file.stem == "diagnosis" and sealed.exists():  # of a blind set
        judged = tallies([(read_yaml(sealed), node)])
        found |= {f"judged.{what}": str(tally) for what, tally in judged.items() if tally.all}
    return found


def read(work, part):
    """{flight: {what: decision}}, a flight for each result file."""
    return {str(file.relative_to(work)): decisions_of(file)
            for file in sorted((work / part).rglob("*.yaml")) if file.stem in OF and "jobs" not in file.parts}


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def same_estimate(name, was, now):
    (value, sigma, status), (value_now, sigma_now, status_now) = was, now
    if not sigma or not sigma_now or not is_number(value):  # a choice: a gate, a rotor, a time
        near = name.endswith("t_step") and abs(value_now - value) <= STEP
        return near or was == now, ""
    moved, ratio = abs(value_now - value) / sigma, sigma_now / sigma
    same = moved <= MOVED and 1 / SIGMA_RATIO <= ratio <= SIGMA_RATIO and status == status_now
    return same, f"moved {moved:.2f} sigmas, sigma x {ratio:.2f}"


def same(name, was, now):
    """(whether the decision is the same, by how much it differs)."""
    if isinstance(was, tuple) and isinstance(now, tuple):
        return same_estimate(name, was, now)
    lists = isinstance(was, list) and isinstance(now, list) and len(was) == len(now)
    pairs = list(zip(was, now)) if lists else [(was, now)]
    if not pairs or "inside" in name or not all(is_number(w) and is_number(n) for w, n in pairs):
        return was == now, ""
    note = ", ".join(f"{100 * (n / w - 1):+.0f} %" for w, n in pairs if w)
    return all(math.isclose(w, n, rel_tol=ERROR, abs_tol=ERROR_M) for w, n in pairs), note


def compare_flight(flight, was, now, comparison):
    lists = [name for name in was if isinstance(was[name], list) and isinstance(now.get(name), list)]
    alone = tuple(f"{name}.{item}." for name in lists
                  for item in {*map(str, was[name])} ^ {*map(str, now[name])})
    for name in dict.fromkeys([*was, *now]):
        if name.startswith(alone):
            continue  # of an item of one side, which the list tells
        before, after = was.get(name), now.get(name)
        if flight.startswith("speed/"):
            ratio = after / before if before and after else math.inf
            if not 1 / SPEED <= ratio <= SPEED:
                comparison.speeds.append((flight, name, before, after, f"x {ratio:.2f}"))
            continue
        equal, note = same(name, before, after)
        comparison.same += equal
        if not equal:
            comparison.changed.append((flight, name, before, after, note))


def compare(was, now, some=False):
    """Of two mappings of decisions by flight. `some`: what one side alone has was not run on the other."""
    comparison = Comparison()
    for flight in dict.fromkeys([*was, *now]):
        if flight in was and flight in now:
            compare_flight(flight, was[flight], now[flight], comparison)
        elif not some:
            there = ["there" if flight in side else "missing" for side in (was, now)]
            comparison.changed.append((flight, "flight", *there, ""))
    return comparison
