"""The page of trueline observe: one matrix of all cases, then each case by itself."""
import math
from errors import ReportError
from page import Page, escape, paragraph
from tables import badge, bullets, number, table
from yaml_file import read_mapping

STATUS = {"ok": ("identified", "ok"), "unobservable": ("unobservable", "u")}


def build(arguments):
    path = arguments.result / "observability.yaml"
    result = read_mapping(path)
    cases = result.get("cases")
    if not cases:
        raise ReportError(f"{path}: holds no cases")
    page = Page("Observability", str(result.get("provenance", {}).get("source", "")))
    page.add("overview", "What is seen", *_overview(cases))
    flights = [case for case in cases if not case["exact"] or case["null_space"]]
    for index, case in enumerate(flights):
        page.add(f"case-{index}", str(case["name"]), *_case(case))
    return page


def _overview(cases):
    groups = _groups(cases)
    headers = [("case", 0), ("motion", 0), ("rank", 1), ("of", 1), ("found", 0)]
    headers += [(group, 0) for group in groups]
    rows = [[f"{escape(case['name'])}<br><small>{escape(', '.join(case['sensors']))}</small>",
             escape(case["inputs"]), str(case["rank"]), str(case["error_states"]),
             "exactly" if case["exact"] else "this flight",
             *[_cell(case, members) for members in groups.values()]] for case in cases]
    note = ("ok: seen. J1, J2: seen only together with the others of that label. u: no output "
            "depends on it. A rank found exactly (in arithmetic modulo a prime) holds for all "
            "flights of the kind but exceptions.")
    return [paragraph(note, "note"), table(headers, rows)]


def _groups(cases):
    """State names by vector, in order: r_BM -> [r_BM_x, r_BM_y, r_BM_z], m -> [m]."""
    groups = {}
    for state in dict.fromkeys(s for case in cases for s in case["per_state"]):
        vector = state[:-2] if state[-2:] in ("_x", "_y", "_z") else state
        groups.setdefault(vector, []).append(state)
    return groups


def _cell(case, members):
    """The status of a vector: one badge, or one for each set of axes that share a status."""
    by_status = {}
    for state in members:
        if state in case["per_state"]:
            by_status.setdefault(case["per_state"][state], []).append(state[-1])
    if len(by_status) == 1:
        return _status(*by_status)
    return "<br>".join(f'<span style="white-space:nowrap">{"".join(axes)}: {_status(status)}</span>'
                       for status, axes in by_status.items())


def _status(status):
    css, text = STATUS.get(status, ("weak", status.split(": ")[-1]))
    return f'<span class="badge {css}">{escape(text)}</span>'


def _case(case):
    blocks = [paragraph(f"Sensors {', '.join(case['sensors'])}; motion: {case['inputs']}. Rank "
                        f"{case['rank']} of {case['error_states']}"
                        f"{' (exact)' if case['exact'] else ' on this flight'}.")]
    joint = [n for n in case["null_space"] if len(n["states"]) > 1]
    if joint:
        rows = [[_status(str(n.get("label", ""))), escape(", ".join(f"{s} {number(v)}" for s, v in n["direction"].items()))]
                for n in joint]
        blocks += ["<h3>Changes that no output shows</h3>",
                   table([("", 0), ("direction, in SI units", 0)], rows)]
    unseen = [s for s, status in case["per_state"].items() if status == "unobservable"]
    if unseen:
        blocks.append(paragraph(f"Not seen at all: {', '.join(unseen)}."))
    if not case["exact"]:
        blocks += _flight(case)
    return blocks


def _flight(case):
    bounds, whole = case.get("crlb") or {}, case.get("crlb_whole_flight") or {}
    rows = [[escape(name), number(entry["value"]),
             number(whole.get(name, {}).get("value", math.nan)), escape(entry["unit"]),
             badge("identified" if math.isfinite(float(entry["value"])) else "unobservable")]
            for name, entry in bounds.items()]
    headers = [("parameter", 0), ("sigma", 1), ("model trusted throughout", 1), ("unit", 0), ("", 0)]
    note = (f"Bound of Cramer and Rao over {case['duration']:.3g} s; the motion model is trusted for "
            f"{case['horizon']:.3g} s at a time. Smallest singular value "
            f"{number(case['sigma_min'])}, condition {number(case['condition'])}.")
    advice = [f"{a['state']}: fly {a['fly']} for 10 s (sigma {number(a['sigma'])} {a['unit']})"
              for a in case.get("advice") or []]
    blocks = ["<h3>Predicted sigmas</h3>", paragraph(note, "note"), table(headers, rows)]
    if advice:
        blocks += ["<h3>What to fly to see more</h3>", bullets(advice)]
    return blocks
