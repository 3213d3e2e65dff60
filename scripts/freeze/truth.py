"""Whether a changed decision is nearer to what was hidden."""
import sys

from compare import labels
from program import SOURCE

sys.path.insert(0, str(SOURCE / "scripts/blind"))
from judge import as_told

# Of a flight that hides an effect of the catalogue: what is called unexplained was noticed, what is
# called clean may be too small to be seen.
VERDICTS = {"explained": 3, "ambiguous": 2, "unexplained": 1, "clean": 1}


def outside(hidden):
    return any(effect["id"].startswith("outside") for effect in hidden)


def points_for_causes(hidden, causes):
    """A point for each hidden effect that is named, half where it is in a confusion set alone, one
    less for each false cause, a quarter more where the first is right."""
    wanted = {effect["id"] for effect in hidden if not effect["id"].startswith("outside")}
    among = [{cause["id"], *cause["confused_with"]} for cause in causes]
    named = {cause["id"] for cause in causes}
    points = sum(1.0 if w in named else 0.5 * any(w in ids for ids in among) for w in wanted)
    points -= sum(not ids & wanted for ids in among)
    return points + 0.25 * bool(causes and causes[0]["id"] in wanted)


def points_for_verdict(hidden, verdict):
    if not hidden:
        return verdict == "clean"
    return verdict == "unexplained" if outside(hidden) else VERDICTS.get(verdict, 0)


def as_diagnosed(cause):
    """A record's cause as the judge reads it."""
    parameters = {name: {"value": value[0], "sigma": value[1]} if isinstance(value, list)
                  else {"value": value} for name, value in cause["parameters"].items()}
    return {**cause, "parameters": parameters}


def sigmas_off(hidden, record, name):
    """Distance of an estimate `cause.parameter` from the hidden one, in its sigmas; None: not hidden."""
    label, parameter = name.split(".")
    cause = dict(zip(labels(record["causes"]), record["causes"]))[label]
    for effect in hidden:
        estimate = cause["parameters"].get(parameter)
        if effect["id"] == cause["id"] and parameter in effect and isinstance(estimate, list):
            true = as_told(effect, as_diagnosed(cause))[parameter]
            return abs(estimate[0] - true) / estimate[1] if estimate[1] else None
    return None


def word(before, after):
    return "neither better nor worse" if after == before else "better" if after > before else "worse"


def judge_change(change, was, now):
    """'better', 'worse' or neither by what is hidden; '' where the truth says nothing."""
    hidden = now.get("hidden")
    if hidden is None or was.get("hidden") != hidden or "causes" not in was or "causes" not in now:
        return ""
    if change.what == "causes":
        return word(*(points_for_causes(hidden, record["causes"]) for record in (was, now)))
    if change.what == "verdict":
        return word(*(points_for_verdict(hidden, record["verdict"]) for record in (was, now)))
    if change.what.split(".")[0] not in labels(now["causes"]) or change.what.count(".") != 1:
        return ""
    off = [sigmas_off(hidden, record, change.what) for record in (was, now)]
    if None in off:
        return ""
    return f"{off[0]:.1f} -> {off[1]:.1f} sigmas off the truth, {word(-off[0], -off[1])}"
