"""Compares the diagnosis of a changed flight with what was hidden in it and with the diagnosis of
the untouched flight."""
from collections import Counter, defaultdict

from draw_hidden import ABSORBED, COUNTED, times
from judge import Tally, as_told, named, within

SCALES = {"fix_scale", "tilt_scale", "accel_scale_z"}
INDICES = ("gate", "rotor")
# Measures of a cause's gain on held-out flight: what each counts.
GAINS = {"gain": "arcs", "gain_open_loop": "replays", "gain_agreement": "seconds"}
OF_FIXES = {"fix_scale", "camera_misalignment", "gate_moved", "false_gate"}


def same_place(hidden, cause, gates):
    """True unless the cause is about another gate or rotor. With two gates, a move of one is the
    opposite move of the other."""
    if hidden["id"] == "false_gate" or (hidden["id"] == "gate_moved" and gates == 2):
        return True
    return all(cause["parameters"].get(name, {}).get("value", hidden[name]) == hidden[name]
               for name in INDICES if name in hidden)


def find(hidden, diagnosis, gates):
    return next((cause for cause in diagnosis["causes"]
                 if cause["id"] == hidden["id"] and same_place(hidden, cause, gates)), None)


def as_effect(cause):
    """A named cause in the form in which hidden effects are stated."""
    return {"id": cause["id"], **{name: p["value"] for name, p in cause["parameters"].items()}}


def sizes(cause):
    return [name for name, parameter in cause["parameters"].items() if "sigma" in parameter]


def combined(hidden, own):
    """What the changed flight has in all, in the terms of `own`: the hidden effect upon one of the
    same kind that the untouched flight has."""
    total, upon = dict(as_told(hidden, own)), as_effect(own)
    for name in sizes(own):
        if name not in hidden:
            continue
        if hidden["id"] in SCALES or name == "factor":
            neutral = 0 if name == "factor" else 1
            total[name] = (neutral + upon[name]) * (neutral + total[name]) - neutral
        else:
            total[name] += upon[name]
    return {**total, **{name: upon[name] for name in INDICES if name in upon}}


def follows(hidden, before, cause):
    """True unless the cause is the untouched flight's own, unmoved by what was hidden: its estimate
    must have moved by at least half of that."""
    if before is None or cause is None:
        return cause is not None
    hidden, now, was = as_told(hidden, cause), as_effect(cause), as_told(as_effect(before), cause)
    pairs = [(hidden[name] - (name == "factor"), now[name] - was[name])
             for name in sizes(cause) if name in hidden]
    return sum(size * moved for size, moved in pairs) >= 0.5 * sum(size * size for size, _ in pairs)


def untouched_p(effect, untouched):
    """The least chance at which the untouched flight's diagnosis would have named it."""
    return min((c["p_value"] for c in untouched["candidates"] if c["id"] == effect), default=None)


def unnamed_size(hidden, untouched):
    """What the untouched flight's diagnosis estimates of the effect without naming it, in the form
    of a cause; None for effects at a gate or rotor. A flight that has a little of the effect by
    itself has in all what was hidden and that."""
    tested = [c for c in untouched["candidates"] if c["id"] == hidden["id"] and "estimate" in c]
    if len(tested) != 1 or any(name in hidden for name in INDICES):
        return None
    estimate, sigma = tested[0]["estimate"], tested[0]["sigma"]
    return {"id": hidden["id"],
            "parameters": {name: {"value": estimate[name], "sigma": sigma[name]} for name in estimate}}


def cause_record(cause, diagnosis):
    """What a cause was named on. `times`: its estimate in detectable sizes."""
    record = {"id": cause["id"], "confidence": cause.get("confidence"),
              "times": round(times(as_effect(cause), diagnosis), 3),
              "parameters": {name: [p["value"], p.get("sigma")] for name, p in cause["parameters"].items()},
              "confused_with": cause["confused_with"]}
    for key, count in GAINS.items():
        if key in cause:
            gain = cause[key]
            record[key] = [gain["before"], gain["after"], *gain.get("interval95", [None, None]), gain[count]]
    if "witness" in cause:
        record["witness"] = cause["witness"]
    return record


def gains_positive(cause):
    return [cause[key]["before"] > cause[key]["after"]
            for key in GAINS if key in cause]


def judge_trial(hidden, untouched, changed, gates):
    """A record of one trial. `untouched`, `changed`: diagnoses."""
    known = {name for names in named(untouched) for name in names}
    absorbed = hidden["id"] in ABSORBED
    before = None if absorbed else find(hidden, untouched, gates)
    total = combined(hidden, before) if before else hidden
    cause = None if absorbed else find(hidden, changed, gates)
    cause = cause if follows(hidden, before, cause) else None
    new = [c for c in changed["causes"] if c is cause or c["id"] not in known]
    false = [c for c in new if c is not cause
             and (absorbed or hidden["id"] not in c["confused_with"]) and not known & set(c["confused_with"])]
    record = {"hidden": hidden, "times": 0.0 if absorbed else round(times(total, untouched), 3),
              "own": [c["id"] for c in untouched["causes"]],
              "named": [c["id"] for c in changed["causes"]],
              "verdicts": [untouched["verdict"], changed["verdict"]],
              "first": bool(new) and new[0] is cause, "at_all": cause is not None,
              "among": any(c is cause or hidden["id"] in c["confused_with"] for c in changed["causes"]),
              "false": [{**cause_record(c, changed), "untouched_p": untouched_p(c["id"], untouched)}
                        for c in false],
              "lost": sorted(known - {name for names in named(changed) for name in names} - {hidden["id"]}),
              "gains": [gains_positive(c) for c in changed["causes"]],
              "set_aside": [[c["id"] for c in of.get("set_aside") or []] for of in (untouched, changed)]}
    if cause:
        told = as_told(total, cause)
        record["expected"], record["estimate"] = told, cause_record(cause, changed)
        record["within"] = list(within(told, cause))
        own_size = None if before else unnamed_size(hidden, untouched)
        changed_by = as_told(combined(hidden, own_size), cause) if own_size else told
        record["within_with_own"] = list(within(changed_by, cause))
    return record


def row(name, records):
    """Of a table: counts over trials."""
    counted = [r for r in records if r["times"] >= COUNTED]
    first, at_all, among, inside, false = Tally(), Tally(), Tally(), Tally(), Tally()
    inside_with_own = Tally()
    for r in counted:
        first.add(r["first"])
        at_all.add(r["at_all"])
        among.add(r["among"])
    for r in records:
        false.add(bool(r["false"]))
        if "within" in r:
            inside.add(*r["within"])
            inside_with_own.add(*r["within_with_own"])
    return (f"| {name} | {len(records)} | {first} | {at_all} | {among} | {inside} | {inside_with_own} "
            f"| {false} |")


HEAD = ["trials", "at twice: first", "at twice: named", "named or confused", "within 2 sigma",
        "with the flight's own", "a false cause beside"]


def rows(records, key):
    groups = defaultdict(list)
    for record in records:
        groups[key(record)].append(record)
    return [row(name, groups[name]) for name in sorted(groups)]


def false_names(records):
    """How often each false cause is named, and beside which hidden effects."""
    beside = defaultdict(Counter)
    for record in records:
        for cause in record["false"]:
            beside[cause["id"]][f"{record['hidden']['id']} ({record['fit']})"] += 1
    order = sorted(beside, key=lambda name: -sum(beside[name].values()))
    return [f"| {name} | {sum(beside[name].values())} | "
            + ", ".join(f"{what} {count}" for what, count in beside[name].most_common()) + " |"
            for name in order]


def head(what):
    return [f"| {what} | {' | '.join(HEAD)} |", "|---" * (len(HEAD) + 1) + "|"]


def own(record):
    return "flight has causes of its own" if record["own"] else "flight has none of its own"


def gain_rows(records):
    all_positive, any_positive = Tally(), Tally()
    for record in records:
        for gains in record["gains"]:
            if gains:
                all_positive.add(all(gains))
                any_positive.add(any(gains))
    return [f"| by every measure | {all_positive} |", f"| by at least one | {any_positive} |"]


def untouched_rows(untouched):
    """Of (flight, fit, whether its fixes were sampled from mocap, diagnosis): what each is said to
    have. Sampled fixes have no error of detector or map, so such a cause is false."""
    tally, lines = Tally(), []
    for flight, fit, sampled, diagnosis in untouched:
        causes = [cause["id"] for cause in diagnosis["causes"]]
        wrong = [name for name in causes if sampled and name in OF_FIXES]
        if sampled:
            tally.add(bool(wrong))
        note = f"; false: {', '.join(wrong)}" if wrong else ""
        lines.append(f"| {flight}, {fit} | {diagnosis['verdict']} | {', '.join(causes) or '-'}{note} |")
    return ["| untouched flight | verdict | causes |", "|---|---|---|", *lines,
            f"| an error of detector or map named where fixes were sampled from mocap | | {tally} |"]


def table(records, untouched):
    """Markdown."""
    effects = [r for r in records if r["hidden"]["id"] not in ABSORBED]
    verdicts = Counter(r["verdicts"][1] for r in records)
    lines = [*head("hidden effect"), *rows(records, lambda r: r["hidden"]["id"]), row("all", records), "",
             *head("fitted to"), *rows(effects, lambda r: r["fit"]), *rows(effects, own), "",
             *head("flight"), *rows(effects, lambda r: f"{r['flight']}, {r['fit']}"), "",
             "| held-out gain of named causes positive | |", "|---|---|", *gain_rows(records), "",
             "| false cause | times | beside |", "|---|---|---|", *false_names(records), "",
             "| verdict | flights |", "|---|---|",
             *(f"| {name} | {count} |" for name, count in sorted(verdicts.items())), "",
             *untouched_rows(untouched)]
    return "\n".join(lines) + "\n"
