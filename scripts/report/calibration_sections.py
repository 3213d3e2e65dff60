"""The parts of the calibration page that are words and tables."""
import math

import yaml

import charts
import plots_residuals
from page import details, escape, paragraph, sentence
from tables import as_number, badge, bullets, interval_95, number, percent, table, tiles, with_sigma

VERDICTS = {
    "usable": "Usable: the parameters and their intervals can be relied on.",
    "poor": "Poor: use it with care, for the reasons below.",
    "unusable": "Unusable: this flight does not calibrate the model.",
}

LACKS = "See what the model lacks: trueline diagnose --log=LOG."
NEXT = {
    "usable": ["Use it: --model=RESULT/model.yaml, for the next flight of the vehicle.",
               LACKS],
    "poor": ["Read the reasons above; faults of the log: trueline inspect --log=LOG.",
             LACKS],
    "unusable": ["Fly with turns, climbs and changes of speed: a hover shows no drag and no misalignment.",
                 "See what a flight shows: trueline observe --log=LOG."],
}


def headline(result, flags=""):
    """Verdict with its reasons, key figures and warnings; `flags` of the commands that come next."""
    summary, verdict = result.summary, result.verdict
    blocks = [f'<div class="verdict {verdict}"><strong>{VERDICTS[verdict]}</strong>'
              f"{bullets(summary.get('reasons') or [])}</div>",
              "<h3>What to do</h3>" + bullets(text.replace("--log=LOG", f"{flags}--log=LOG") for text in NEXT[verdict])]
    arcs = summary.get("arcs") or {}
    error = arcs.get("final_point_error") or {}
    if arcs.get("count"):
        unit = error.get("unit", "m")
        blocks.append(tiles([
            (number(error.get("mean"), 2, unit), "mean final-point error"),
            (number(error.get("median"), 2, unit), "median"),
            (number(error.get("p95"), 2, unit), "95 % of arcs below"),
            (percent(arcs.get("inside_95_ellipse")), "of ends inside their 95 % ellipse"),
            (str(arcs["count"]), "arcs predicted")]))
    if fixes := summary.get("fixes"):
        blocks.append(paragraph(sentence(fixes["text"])))
    warnings = summary.get("warnings") or []
    if warnings:
        blocks.append(f'<div class="warnings"><b>Warnings</b>{bullets(warnings)}</div>')
    return blocks


def parameter_table(parameters, truth=None):
    """By name, as in the YAML: value ± one sigma, 95 % interval, status; the truth, if known."""
    truth = truth or {}
    rows = []
    for name, entry in (parameters or {}).items():
        value, sigma = as_number(entry.get("value")), as_number(entry.get("sigma"))
        unit, status = str(entry.get("unit", "")), str(entry.get("status", ""))
        sigma = sigma if status != "unobservable" else math.nan
        rows.append([f"<code>{escape(name)}</code>", escape(str(entry.get("meaning", ""))),
                     escape(with_sigma(value, sigma)),
                     escape(interval_95(value, sigma)), escape(unit), escape(_in_degrees(value, sigma, unit)),
                     badge(status)])
        if truth:
            rows[-1] += _beside_truth(value, sigma, truth.get(name, math.nan))
    if not rows:
        return paragraph("No parameter was estimated.")
    headers = [("Parameter", False), ("", False), ("Value ± 1 sigma", True), ("95 % interval", True), ("Unit", False),
               ("In degrees", True), ("Status", False)] + ([("Truth", True), ("Error / sigma", True)] if truth else [])
    filled = [column for column in range(len(headers)) if any(row[column] for row in rows)]
    return table([headers[column] for column in filled], [[row[column] for column in filled] for row in rows])


def _beside_truth(value, sigma, truth):
    off = (value - truth) / sigma if sigma > 0 else math.nan
    return [escape(number(truth)) if math.isfinite(truth) else "–",
            escape(f"{off:+.1f}") if math.isfinite(off) else "–"]


def _in_degrees(value, sigma, unit):
    return with_sigma(math.degrees(value), math.degrees(sigma)) if unit == "rad" else ""


def unobservable(summary):
    """The unobservable combinations, in words."""
    combinations = summary.get("unobservable") or []
    if not combinations:
        return ""
    return paragraph("This flight does not show, or can't tell apart:") + bullets(combinations)


def whole_flight(result, truth=None):
    """All of the flight, or of several, solved at once: what the smoother adds."""
    whole = result.summary.get("whole_flight")
    if not whole:
        return []
    flights = whole.get("flights", 1)
    of = "this flight" if flights == 1 else f"{flights} flights of this vehicle"
    blocks = [paragraph(f"All of {of} at once: {whole.get('passes')} passes in "
                        f"{number(whole.get('duration'), 4, 's')}. Attitude errors, biases and gusts "
                        "drift; values are their means.", "note")]
    if not whole.get("converged", True):
        blocks.append(f'<div class="warnings"><b>Not converged</b> after '
                      f"{whole.get('iterations')} iterations: use with care.</div>")
    blocks += [parameter_table(whole.get("parameters"), truth), unobservable(whole)]
    if whole.get("notes"):
        blocks.append(bullets(whole["notes"]))
    rows = [[f"<code>{escape(name)}</code>", number(entry["value"]),
             " to ".join(number(end) for end in entry["interval95"]), escape(entry["unit"])]
            for name, entry in (whole.get("strengths") or {}).items()]
    if rows:
        blocks += ["<h3>What drifts, and how strongly</h3>",
                   table([("Learned", False), ("Value", True), ("95 % interval", True),
                          ("Unit", False)], rows)]
    return blocks


def arc_summary(result):
    """One row an estimator and gamma: errors, coverage, effort."""
    rows = []
    for (estimator, gamma), arcs in result.arcs.groupby(["estimator", "gamma"], sort=False):
        error, inside = arcs.final_point_error.dropna(), arcs.inside_95.dropna()
        scored = f"{len(error)} of {len(arcs)}"
        rows.append([escape(charts.NAMES.get(estimator, estimator)), f"{gamma:g}", scored,
                     number(error.mean()), number(error.median()), number(error.quantile(0.95)),
                     percent(inside.mean()), number(arcs.iterations.mean()),
                     number(1e3 * arcs.solve_time.mean())])
    truth = sorted({t for t in result.arcs.truth if t})
    return table([("Estimator", False), ("gamma", True), ("Arcs with truth", True), ("Mean [m]", True),
                  ("Median [m]", True), ("95 % below [m]", True), ("In 95 % ellipse", True),
                  ("Iterations", True), ("Solve [ms]", True)], rows) + (
        paragraph(f"Truth at the end of an arc: {', '.join(truth)}.", "note") if truth else "")


def residual_table(residuals):
    rows = [[axis, str(count), number(mean, 2), number(deviation, 3), percent(share)]
            for axis, count, mean, deviation, share in plots_residuals.statistics(residuals)]
    return table([("Axis", False), ("Fixes", True), ("Mean [sigma]", True),
                  ("Standard deviation [sigma]", True), ("Within 1.96 sigma", True)], rows)


def provenance(result):
    """Where the result comes from, enough to make it again."""
    entries = result.summary.get("provenance") or {}
    rows = [[escape(key), f"<code>{escape(value)}</code>"] for key, value in entries.items()
            if key not in ("sha256", "config")]
    sums = [[escape(file), f"<code>{escape(value)}</code>"]
            for file, value in (entries.get("sha256") or {}).items()]
    blocks = [table([("", False), ("", False)], rows)]
    if sums:
        blocks.append(details("SHA-256 of the files read",
                              table([("File", False), ("SHA-256", False)], sums)))
    if entries.get("config"):
        text = yaml.safe_dump(entries["config"], sort_keys=False, allow_unicode=True)
        blocks.append(details("Configuration, with every default", f"<pre>{escape(text)}</pre>"))
    return blocks
