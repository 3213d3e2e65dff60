"""The page of trueline audit: what a simulator's file gets wrong, what it costs, what was not judged."""
from pathlib import Path

from page import Page, escape, paragraph, verdict
from tables import number, table, tiles, with_sigma
from yaml_file import read_mapping

HORIZONS = (0.25, 0.5, 1.0)


def build(arguments):
    result = read_mapping(arguments.result / "audit.yaml")
    page = Page("Audit of a simulator", str(result.get("simulator", "")))
    page.add("contradicted", "Result", *_contradicted(result))
    if result.get("before"):
        page.add("proof", "Held-out flight", *_proof(result))
    if result.get("compared"):
        page.add("compared", "All that was compared", _compared(result))
    if result.get("lacks"):
        page.add("lacks", "What the simulator lacks",
                 table([("effect", 0), ("", 0)],
                       [[escape(e["effect"]), escape(e["text"])] for e in result["lacks"]]))
    compared = {c["parameter"] for c in result.get("compared") or []}
    not_judged = [n for n in result.get("not_judged") or [] if n["parameter"] not in compared]
    if not_judged:
        page.add("not-judged", "Not judged",
                 table([("parameter", 0), ("what to fly", 0)],
                       [[escape(n["parameter"]), escape(n["fly"])] for n in not_judged]))
    return page


def _contradicted(result):
    entries = result.get("contradicted") or []
    if not entries:
        return [verdict("good", "The flights do not contradict the file." if result.get("compared") else
                        "The file does not contradict itself, nor what vehicles have.")]
    rows = [[escape(c["parameter"]), number(c["file_value"], 4), _flight(c), escape(c["unit"]),
             _error(c.get("cost"), 0.5), escape(c["text"]), _place(c)]
            for c in entries]
    headers = [("parameter", 0), ("in the file", 1), ("by the flight", 1), ("unit", 0),
               ("cost in 0.5 s [m]", 1), ("", 0), ("where", 0)]
    return [verdict("bad", "The file is wrong; the corrected one lies beside this page.",
                    [f"{c['parameter']}: {number(c['file_value'], 4)} {c['unit']} in the file, {_flight(c)} by the flight"
                     if "flight_value" in c else f"{c['parameter']}: {number(c['file_value'], 4)} {c['unit']}"
                     for c in entries]), table(headers, rows),
            paragraph("Cost: how much farther predictions of held-out flight err with the file's "
                      "value than with the flight's. Without a flight the file contradicts itself, "
                      "or what vehicles have.", "note")]


def _flight(entry):
    return with_sigma(entry["flight_value"], entry["sigma"]) if "flight_value" in entry else "–"


def _place(entry):
    place = entry.get("place") or {}
    if not place.get("line"):
        return ""
    return f'{escape(Path(place["file"]).name)}:{place["line"]}<br><small>{escape(place["key"])}</small>'


def _error(errors, horizon):
    """As text: a number, or that the prediction diverges."""
    error = (errors or {}).get(horizon)
    return error if isinstance(error, str) else number(error)


def _proof(result):
    def tile(errors):
        return _error(errors, 0.5) + ("" if isinstance(errors.get(0.5), str) else " m")
    tiles_of = [(tile(result["before"]), "after 0.5 s with the file"), (tile(result["after"]), "with the corrected file")]
    rows = [[number(h), _error(result["before"], h), _error(result["after"], h),
             _error(result.get("flight"), h)] for h in HORIZONS]
    headers = [("horizon [s]", 1), ("file [m]", 1), ("corrected [m]", 1), ("flight's own fit [m]", 1)]
    return [tiles(tiles_of), table(headers, rows)]


def _compared(result):
    contradicted = {c["parameter"] for c in result.get("contradicted") or []}
    undecided = {n["parameter"]: n["fly"] for n in result.get("not_judged") or []}

    def verdict_of(c):
        if c["contradicted"] or c["parameter"] in contradicted:
            return "contradicted"
        if c["parameter"] in undecided:
            return f'undecided: {undecided[c["parameter"]]}'
        if "cost" in c:
            return f'differs as vehicles of one kind do; costs {_error(c["cost"], 0.5)} m in 0.5 s'
        return "agrees"
    rows = [[escape(c["parameter"]), number(c["file_value"], 4),
             with_sigma(c["flight_value"], c["sigma"]), number(c["tolerance"], 2),
             escape(c["unit"]), escape(verdict_of(c))] for c in result["compared"]]
    return table([("parameter", 0), ("in the file", 1), ("by the flight", 1),
                  ("vehicles differ by", 1), ("unit", 0), ("", 0)], rows)
