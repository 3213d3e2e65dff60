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


def named(diagnosis, effects=()):
    """Ids of each cause with its confusion set. Of a cause at another rotor than any of `effects`
    the id says so."""
    return [[id_at_place(cause, effects), *cause["confused_with"]] for cause in diagnosis["causes"]]


def id_at_place(cause, effects):
    rotors = [effect["rotor"] for effect in effects if effect["id"] == cause["id"] and "rotor" in effect]
    elsewhere = rotors and cause["parameters"]["rotor"]["value"] not in rotors
    return f"{cause['id']} elsewhere" if elsewhere else cause["id"]


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


FALSE = "a cause named on flights that hide nothing"
PAIRS = "two causes, both at twice their detectable size, both named"
UNEXPLAINED = "outside of the catalogue: called unexplained"
NONE_NAMED = "outside of the catalogue: no catalogue effect named"
WITHIN = "parameters within 2 sigma"
FINAL_POINT = "held-out gain positive where a cause is named: final point of blind arcs"
OPEN_LOOP = "the same: open-loop error over a second"
EITHER = "the same: at least one of those measured"
AT_TWICE = "at twice the detectable size"
FIRST, AMONG = f"{AT_TWICE}, named first", f"{AT_TWICE}, first or in its confusion set"


def tally_gains(diagnosis, tally):
    for cause in diagnosis["causes"]:
        gains = [cause[key]["before"] > cause[key]["after"]
                 for key in ("gain", "gain_open_loop") if key in cause]
        if len(gains) == 2:
            tally[FINAL_POINT].add(gains[0])
            tally[OPEN_LOOP].add(gains[1])
        if gains:
            tally[EITHER].add(any(gains))


def tally_names(effects, diagnosis, tally):
    causes = named(diagnosis, effects)
    if not effects:
        tally[FALSE].add(bool(causes))
    elif effects[0]["id"].startswith("outside"):
        tally[UNEXPLAINED].add(diagnosis["verdict"] == "unexplained")
        tally[NONE_NAMED].add(not causes)
    elif len(effects) == 2:
        if all(times_detectable(e, diagnosis) >= 2 for e in effects):
            tally[PAIRS].add(all(any(e["id"] in ids for ids in causes) for e in effects))
    elif times_detectable(effects[0], diagnosis) >= 2:
        tally_single(effects[0]["id"], causes, tally)


def tally_single(wanted, causes, tally):
    for effect in (wanted, "all"):
        tally[f"{FIRST}: {effect}"].add(bool(causes) and causes[0][0] == wanted)
        tally[f"{AMONG}: {effect}"].add(bool(causes) and wanted in causes[0])


def tally_within(effects, diagnosis, tally):
    for effect in effects:
        for cause in diagnosis["causes"]:
            if id_at_place(cause, [effect]) == effect["id"]:
                tally[WITHIN].add(*within(effect, cause))


def tallies(flights):
    """By what is counted, of (hidden, diagnosis) by flight."""
    tally = {what: Tally() for what in (FALSE, PAIRS, UNEXPLAINED, NONE_NAMED, WITHIN, FINAL_POINT,
                                        OPEN_LOOP, EITHER)}
    tally = defaultdict(Tally, tally)
    tally[f"{FIRST}: all"], tally[f"{AMONG}: all"] = Tally(), Tally()
    for hidden, diagnosis in flights:
        tally_gains(diagnosis, tally)
        tally_names(hidden["effects"], diagnosis, tally)
        tally_within(hidden["effects"], diagnosis, tally)
    return tally


def table(work):
    tally = tallies(read(work))
    effects = sorted(what.split(": ")[1] for what in tally if what.startswith(f"{FIRST}: "))
    effects = [effect for effect in effects if effect != "all"] + ["all"]
    general = [what for what in tally if not what.startswith((f"{FIRST}: ", f"{AMONG}: "))]
    lines = ["| what | result |", "|---|---|", *(f"| {what} | {tally[what]} |" for what in general), "",
             f"| {AT_TWICE} | named first | first, or in its confusion set |", "|---|---|---|",
             *(f"| {effect} | {tally[f'{FIRST}: {effect}']} | {tally[f'{AMONG}: {effect}']} |"
               for effect in effects)]
    return "\n".join(lines) + "\n"
