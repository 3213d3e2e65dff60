"""The page of trueline inspect: findings, what was compared, each stream, and what was not checked."""
from pathlib import Path

import plots_inspection
from charts import embed
from page import Page, details, escape, paragraph, verdict
from tables import bullets, number, table, with_sigma
from yaml_file import read_mapping

# Levels by the badges of the style sheet.
BADGES = {"fatal": "unusable", "biases": "at_bound", "widens": "weak", "note": "identified"}
LEVELS = ("fatal: no calibration is possible, or each is wrong. biases: parameters come out wrong by "
          "more than their intervals say. widens: they come out less certain. note: no harm by itself. "
          "The error of the specific force in earth axes, where a fault makes one, orders a level.")


HARM = ("fatal", "biases", "widens", "note")
ANSWERS = {"fatal": ("bad", "This log can't give a right calibration as it is."),
           "biases": ("bad", "A calibration of this log comes out wrong by more than it says."),
           "widens": ("fair", "This log can be used; what it shows is less certain."),
           "note": ("good", "This log can be used."),
           None: ("good", "No fault was found in what could be checked.")}


def add_arguments(parser):
    parser.add_argument("--log", type=Path, help="the native log, to draw its streams; without it no plots")


def build(arguments):
    result = read_mapping(arguments.result / "inspection.yaml")
    streams = plots_inspection.read_streams(arguments.log) if arguments.log else {}
    findings = result.get("findings") or []
    page = Page("Inspection of a log", str(result.get("log", "")))
    page.add("answer", "Result", *_answer(result, findings))
    if findings:
        page.add("findings", "Findings", *_findings(result))
    if streams:
        page.add("time", "Time line", paragraph(
            "Blue: samples. Red bands: gaps. Diamonds: findings, where their text names a time, else along the "
            "whole stream.", "note"), embed(plots_inspection.time_line(streams, findings), "plot-time"))
    page.add("across", "Streams against each other", *_comparisons(result.get("comparisons") or [], streams))
    if result.get("rotors"):
        page.add("rotors", "Rotors", *_rotors(result["rotors"]))
    page.add("streams", "Each stream", *_streams(result.get("streams") or [], streams))
    if result.get("not_checked"):
        page.add("not-checked", "Not checked", bullets(result["not_checked"]))
    return page


def _answer(result, findings):
    worst = min((f["level"] for f in findings), key=HARM.index, default=None)
    kind, text = ANSWERS[worst]
    said = dict.fromkeys(f'{f["id"].replace("_", " ")} ({f["stream"]}): {f["remedy"]}' for f in findings
                         if f["level"] != "note")
    blocks = [verdict(kind, text, list(said)[:5])]
    if result.get("corrected_by"):
        blocks += [paragraph("Nothing was changed. This command makes a repaired log:"),
                   f'<pre>{escape(result["corrected_by"])}</pre>']
    return blocks


def _findings(result):
    rows = [[f'<span class="badge {BADGES[f["level"]]}">{escape(f["level"])}</span>',
             f'{escape(f["id"].replace("_", " "))}<br><small>{escape(f["stream"])}</small>',
             f'{escape(f["text"])}<br><small>{escape(f["remedy"])}</small>', _size(f),
             number((f.get("force_error") or {}).get("value"), 2),
             "yes" if f.get("repaired") else "no"] for f in result["findings"]]
    headers = [("level", 0), ("what", 0), ("found, and its remedy", 0), ("size", 1),
               ("force error [m/s²]", 1), ("in corrected map", 0)]
    return [table(headers, rows), details("What the levels mean", paragraph(LEVELS, "note"))]


def _size(finding):
    size = with_sigma(finding["size"], finding["sigma"]) if "sigma" in finding \
        else number(finding["size"])
    return f'{size} {escape(finding["unit"])}' if finding["unit"] != "1" else size


def _comparisons(comparisons, streams):
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
    figure = plots_inspection.overlays(comparisons, streams)
    drawn = [paragraph(f"Grey: the reference. Blue: the stream, moved by the best lag. Lengths of "
                       f"vectors, which no mounting changes, over {plots_inspection.SHOWN:g} s of the "
                       "flight.", "note"), embed(figure, "plot-overlays")] if figure else []
    return drawn + [details("All comparisons", paragraph(note, "note") + table(headers, rows))]


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


def _streams(health, streams):
    headers = [("stream", 0), ("samples", 1), ("rate [Hz]", 1), ("jitter [ms]", 1), ("gaps", 1),
               ("longest [s]", 1), ("repeats", 1), ("spikes", 1)]
    rows = [[escape(s["stream"]), str(s["samples"]), number(s["rate_Hz"]),
             number(1e3 * s["jitter_s"]), str(s["gaps"]), number(s["longest_gap_s"]),
             f'{100 * s["repeats"]:.0f} %', str(s["spikes"])] for s in health]
    blocks = [table(headers, rows)]
    axes = [a for s in health for a in s.get("axes") or []]
    if axes and "imu" in streams:
        blocks.append(embed(plots_inspection.spectra(streams, axes), "plot-spectra"))
    if axes:
        headers = [("axis", 0), ("unit", 0), ("quantum", 1), ("noise density [/√Hz]", 1),
                   ("rms above 20 Hz", 1), ("line [Hz]", 1), ("filter's cut-off [Hz]", 1),
                   ("spikes", 1)]
        blocks.append(details("Each axis of the IMU", table(headers, [
            [escape(a["axis"]), escape(a["unit"]), _or_none(a["quantum"]),
             number(a["noise_density_per_sqrt_Hz"]), number(a["above_20_Hz_rms"]),
             _or_none(a["line_Hz"]), _or_none(a["cutoff_Hz"]), str(a["spikes"])] for a in axes])))
    return blocks


def _or_none(value):
    return number(value) if value else "–"
