"""Compares diagnoses with what was sealed."""
import math
from collections import defaultdict

import yaml

NOT_COMPARED = {"gate", "rotor", "t_step"}


def read(work):
    """(hidden, diagnosis) by flight, for flights that were flown and diagnosed."""
    for file in sorted((work / "sealed").glob("*.hidden.yaml")):
        name = file.name.split(".")[0]
        result = work / "results" / name / "diagnosis.yaml"
        hidden = yaml.safe_load(file.read_text())
        if hidden["flown"] and result.exists():
            yield hidden, yaml.safe_load(result.read_text())


def times_detectable(effect, diagnosis):
    """Size over the detectable size, by the diagnosis' own account: root of the sum of squares over
    the effect's parameters, for the best of its candidates."""
    best = 0.0
    for candidate in diagnosis["candidates"]:
        if candidate["id"] != effect["id"]:
            continue
        parts = [((effect[name] - (name == "factor")) / size) ** 2
                 for name, size in candidate["detectable_size"].items() if name in effect]
        best = max(best, math.sqrt(sum(parts)))
    return best


def named(diagnosis):
    """Ids of each cause with its confusion set."""
    return [[cause["id"], *cause["confused_with"]] for cause in diagnosis["causes"]]


def as_told(effect, cause):
    """The effect in the cause's terms: with two gates, a move of one is the opposite of the other's."""
    if effect["id"] != "gate_moved" or cause["parameters"]["gate"]["value"] == effect["gate"]:
        return effect
    return {**effect, **{axis: -effect[axis] for axis in ("dx", "dy", "dz")}}


def within(effect, cause):
    """(parameters within 2 sigma, parameters compared)."""
    effect = as_told(effect, cause)
    compared = [name for name, parameter in cause["parameters"].items()
                if name in effect and name not in NOT_COMPARED and "sigma" in parameter]
    good = sum(abs(cause["parameters"][n]["value"] - effect[n]) <= 2 * cause["parameters"][n]["sigma"]
               for n in compared)
    return good, len(compared)


class Tally:
    def __init__(self):
        self.good = self.all = 0

    def add(self, good, count=1):
        self.good += good
        self.all += count

    def __str__(self):
        return f"{self.good} of {self.all}" + (f" ({100 * self.good / self.all:.0f} %)" if self.all else "")


def table(work):
    false, pairs, outside, coverage, gain, open_loop, either = (Tally() for _ in range(7))
    unexplained = Tally()
    first, among = defaultdict(Tally), defaultdict(Tally)
    for hidden, diagnosis in read(work):
        effects, causes = hidden["effects"], named(diagnosis)
        for cause in diagnosis["causes"]:
            gains = [cause[key]["before"] > cause[key]["after"]
                     for key in ("gain", "gain_open_loop") if key in cause]
            if len(gains) == 2:
                gain.add(gains[0])
                open_loop.add(gains[1])
            if gains:
                either.add(any(gains))
        if not effects:
            false.add(bool(causes))
        elif effects[0]["id"].startswith("outside"):
            unexplained.add(diagnosis["verdict"] == "unexplained")
            outside.add(not causes)
        elif len(effects) == 2:
            if all(times_detectable(e, diagnosis) >= 2 for e in effects):
                pairs.add(all(any(e["id"] in ids for ids in causes) for e in effects))
        elif times_detectable(effects[0], diagnosis) >= 2:
            wanted = effects[0]["id"]
            first[wanted].add(bool(causes) and causes[0][0] == wanted)
            among[wanted].add(bool(causes) and wanted in causes[0])
        for effect in effects:
            for cause in diagnosis["causes"]:
                if cause["id"] == effect["id"]:
                    coverage.add(*within(effect, cause))
    lines = ["| what | result |", "|---|---|",
             f"| a cause named on flights that hide nothing | {false} |",
             f"| two causes, both at twice their detectable size, both named | {pairs} |",
             f"| outside of the catalogue: called unexplained | {unexplained} |",
             f"| outside of the catalogue: no catalogue effect named | {outside} |",
             f"| parameters within 2 sigma | {coverage} |",
             f"| held-out gain positive where a cause is named: final point of blind arcs | {gain} |",
             f"| the same: open-loop error over a second | {open_loop} |",
             f"| the same: at least one of those measured | {either} |", "",
             "| at twice the detectable size | named first | first, or in its confusion set |",
             "|---|---|---|"]
    total, total_among = Tally(), Tally()
    for effect in sorted(first):
        lines.append(f"| {effect} | {first[effect]} | {among[effect]} |")
        total.add(first[effect].good, first[effect].all)
        total_among.add(among[effect].good, among[effect].all)
    return "\n".join([*lines, f"| all | {total} | {total_among} |"]) + "\n"
