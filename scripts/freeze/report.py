"""What run.py prints."""
from truth import judge_change


def shown(value):
    """An estimate as 1.2 +- 0.1, lists in brackets, nothing as a dash."""
    if value is None:
        return "-"
    if not isinstance(value, list):
        return str(value)
    if len(value) in (2, 3) and all(isinstance(x, (int, float)) for x in value[:2]):
        return f"{value[0]} +- {value[1]}" + "".join(f" {word}" for word in value[2:])
    return "[" + ", ".join(str(x["id"] if isinstance(x, dict) else x) for x in value) + "]"


def pair(value):
    """Of an error: before -> after causes or calibration."""
    return " / ".join(map(str, value)) if isinstance(value, list) else shown(value)


def hidden_text(record):
    """What the flight hides, with sizes."""
    if "hidden" not in record:
        return ""
    effects = [" ".join([effect["id"], *(f"{name} {value:.3g}" for name, value in effect.items()
                                         if isinstance(value, (int, float)))])
               for effect in record["hidden"]]
    return f" (hidden: {', '.join(effects) or 'nothing'})"


def is_error(change):
    return change.what.startswith("errors.") or ".gain" in change.what


def line(change, was, now):
    show = pair if is_error(change) else shown
    text = f"  {change.flight}  {change.what}: {show(change.was)} -> {show(change.now)}"
    notes = [note for note in (change.note, judge_change(change, was, now)) if note]
    return text + (f"  [{'; '.join(notes)}]" if notes else "")


def print_changes(part, comparison, was, now):
    if not was:
        print(f"{part}: nothing is kept yet")
        return
    seen = set()
    for change in comparison.changed + comparison.slower:
        before, after = was.get(change.flight, {}), now.get(change.flight, {})
        if change.flight not in seen:
            print(f"{part} {change.flight}{hidden_text(after)}")
        seen.add(change.flight)
        print(line(change, before, after))


def print_table(comparisons):
    print(f"\n{'part':<18}{'same':>8}{'changed':>9}{'speeds beyond 15 %':>20}")
    for part, comparison in comparisons.items():
        print(f"{part:<18}{comparison.same:>8}{len(comparison.changed):>9}"
              f"{len(comparison.slower):>20}")


def share(rate):
    return "-" if rate is None else f"{rate[0]} of {rate[1]}"


def print_rates(part, was, now):
    if not now:
        return
    print(f"{part + ', rates':<84}{'kept':>12}{'now':>12}")
    for what in dict.fromkeys([*was, *now]):
        print(f"  {what:<82}{share(was.get(what)):>12}{share(now.get(what)):>12}")
    print()
