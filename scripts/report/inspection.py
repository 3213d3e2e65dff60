"""The page of trueline-inspect: findings, what was compared, each stream, and what was not checked."""
from page import Page, escape, paragraph
from tables import bullets, number, table, with_sigma
from yaml_file import read_mapping

VERB_HELP = "the result of trueline-inspect"
PROGRAM = "trueline-inspect"
# Levels by the badges of the style sheet.
BADGES = {"fatal": "unusable", "biases": "at_bound", "widens": "weak", "note": "identified"}
LEVELS = ("fatal: no calibration is possible, or each is wrong. biases: parameters come out wrong by "
          "more than their intervals say. widens: they come out less certain. note: no harm by itself. "
          "The error of the specific force in earth axes, where a fault makes one, orders a level.")


def build(arguments):
    result = read_mapping(arguments.result / "inspection.yaml", "run trueline-inspect first")
    page = Page("Inspection of a log", str(result.get("log", "")))
    page.add("findings", "Findings", *_findings(result))
    page.add("across", "Streams against each other", *_comparisons(result.get("comparisons") or []))
    if result.get("rotors"):
        page.add("rotors", "Rotors", *_rotors(result["rotors"]))
    page.add("streams", "Each stream", *_streams(result.get("streams") or []))
    if result.get("not_checked"):
        page.add("not-checked", "Not checked", bullets(result["not_checked"]))
    return page


def _findings(result):
    findings = result.get("findings") or []
    if not findings:
        return [paragraph("No fault was found.")]
    rows = [[f'<span class="badge {BADGES[f["level"]]}">{escape(f["level"])}</span>',
             f'{escape(f["id"].replace("_", " "))}<br><small>{escape(f["stream"])}</small>',
             escape(f["text"]), escape(f["remedy"]), _size(f),
             number((f.get("force_error") or {}).get("value"), 2),
             "yes" if f.get("repaired") else "no"] for f in findings]
    headers = [("level", 0), ("what", 0), ("found", 0), ("remedy", 0), ("size", 1),
               ("force error [m/s²]", 1), ("in corrected map", 0)]
    blocks = [paragraph(LEVELS, "note"), table(headers, rows)]
    if result.get("corrected_by"):
        blocks += [paragraph("Nothing was changed. This command makes a repaired log:"),
                   f'<pre>{escape(result["corrected_by"])}</pre>']
    return blocks


def _size(finding):
    size = with_sigma(finding["size"], finding["sigma"]) if "sigma" in finding \
        else number(finding["size"])
    return f'{size} {escape(finding["unit"])}' if finding["unit"] != "1" else size


def _comparisons(comparisons):
    if not comparisons:
        return [paragraph("No two streams could be compared.")]
    headers = [("stream", 0), ("what", 0), ("correlation", 1), ("late by [ms]", 1),
               ("turned by [deg]", 1), ("size ratio", 1), ("", 0)]
    rows = []
    for c in comparisons:
        row = [escape(c["stream"]), escape(c["what"]), number(c.get("correlation"))]
        if c.get("shown"):
            late, turn, ratio = c["late_by"], c["turned_by"], c["size_ratio"]
            row += [with_sigma(1e3 * late["value"], 1e3 * late["sigma"]),
                    "<br>".join(f"{axis}: {with_sigma(v, s)}"
                                for axis, v, s in zip("xyz", turn["value"], turn["sigma"])),
                    with_sigma(ratio["value"], ratio["sigma"]),
                    "mirrored" if c.get("mirrored") else ""]
        else:
            row += ["–", "–", "–", f'not shown: {escape(c.get("why_not", ""))}']
        rows.append(row)
    note = ("At the best lag and the best rotation or reflection; one standard deviation by the "
            "jackknife over ten parts of the flight.")
    return [paragraph(note, "note"), table(headers, rows)]


def _rotors(rotors):
    explained = rotors["explained"]
    text = (f'{rotors["stream"]}.csv explains {100 * explained["roll"]:.0f} % of the roll, '
            f'{100 * explained["pitch"]:.0f} % of the pitch and {100 * explained["yaw"]:.0f} % of the '
            f'yaw acceleration; the body answers after {number(rotors["answer_after"]["value"])} s.')
    rows = [[str(i), escape(c["front"]), escape(c["side"]), escape(c["spin"])]
            for i, c in enumerate(rotors.get("channels") or [], 1)]
    headers = [("channel", 1), ("sits in", 0), ("on the", 0),
               ("spin (1: clockwise from above)", 0)]
    return [paragraph(text), table(headers, rows)]


def _streams(streams):
    headers = [("stream", 0), ("samples", 1), ("rate [Hz]", 1), ("jitter [ms]", 1), ("gaps", 1),
               ("longest [s]", 1), ("repeats", 1), ("spikes", 1)]
    rows = [[escape(s["stream"]), str(s["samples"]), number(s["rate_Hz"]),
             number(1e3 * s["jitter_s"]), str(s["gaps"]), number(s["longest_gap_s"]),
             f'{100 * s["repeats"]:.0f} %', str(s["spikes"])] for s in streams]
    blocks = [table(headers, rows)]
    axes = [a for s in streams for a in s.get("axes") or []]
    if axes:
        headers = [("axis", 0), ("unit", 0), ("quantum", 1), ("noise density [/√Hz]", 1),
                   ("rms above 20 Hz", 1), ("line [Hz]", 1), ("filter's cut-off [Hz]", 1),
                   ("spikes", 1)]
        blocks.append(table(headers, [
            [escape(a["axis"]), escape(a["unit"]), _or_none(a["quantum"]),
             number(a["noise_density_per_sqrt_Hz"]), number(a["above_20_Hz_rms"]),
             _or_none(a["line_Hz"]), _or_none(a["cutoff_Hz"]), str(a["spikes"])] for a in axes]))
    return blocks


def _or_none(value):
    return number(value) if value else "–"
