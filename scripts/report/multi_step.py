"""The page of a multi-step prediction experiment: scores beside baselines and published figures."""
from plotly.subplots import make_subplots

import charts
from csv_table import read_table
from page import Page, escape, paragraph
from tables import fitted_numbers, number, table
from yaml_file import read_mapping

QUANTITIES = {"p": "Position [m]", "v": "Velocity [m/s]", "R": "Attitude [rad]", "w": "Rate [rad/s]"}
HORIZONS = ("h1", "h10", "h50", "sum")
PAIRS = (("p", "v"), ("R", "w"))  # of quantities that a table holds: four are wider than a screen
COLOURS = ["#8a94a3", "#e07b00", "#b0389a", "#1f6feb"]
AVERAGES = {
    "concatenated": "Runs in a row, as the repository's metric: the published table is of this kind",
    "within": "Every window with its own run, mean over runs"}


def build(arguments):
    summary = read_mapping(arguments.result / "summary.yaml")
    horizons = read_table(arguments.result / "horizons.csv", ["horizon", *QUANTITIES],
                          ["trajectory", "predictor", "average"])
    page = Page(str(summary["name"]), str(summary.get("about", "")))
    trained = summary.get("folds") or {}
    page.add("scores", "Mean absolute errors", paragraph(
        "Each trajectory is predicted by a fit to the others." if trained else
        f"Fitted to {', '.join(map(str, summary['fit']['trained_on']))}; predicted is what is listed.", "note"),
        *_scores(summary["scores"]))
    if summary.get("published"):
        page.add("published", "Published, on the benchmark's test trajectory", *_published(summary),
                 paragraph("Comparable with rows above only where these are of that trajectory.",
                           "note"))
    page.add("horizons", "Errors by horizon", *(
        charts.embed(_curves(part, escape(name)), f"plot-{index}") for index, (name, part)
        in enumerate(horizons[horizons.average == "within"].groupby("trajectory"))))
    if summary.get("tubes"):
        page.add("tubes", "What the tubes hold", *_tubes(summary["tubes"]), paragraph(
            "Share of a trajectory's windows whose error is inside the radius that predictions.csv states.", "note"))
    page.add("numbers", "Numbers of the model", fitted_numbers(summary["fit"]["numbers"], trained), paragraph(
        "One standard deviation by the spread between runs, or between trajectories where that is "
        "more. The last columns: the fits that leave out one trajectory.", "note"))
    page.add("processes", "Numbers of the attitude processes", _processes(summary["fit"]))
    return page


def _scores(scores):
    blocks = []
    for average, meaning in AVERAGES.items():
        blocks += [f"<h3>{escape(meaning)}</h3>", *_tables(("Trajectory", "Predictor"), HORIZONS, [
            ([s["trajectory"], s["predictor"]], _cells(s[average])) for s in scores])]
    return blocks


def _tubes(rows):
    shown = ("h1", "h10", "h50", "mean")
    return _tables(("Trajectory", "Meant"), shown, [
        ([row["trajectory"], chance],
         {q: [f"{100 * of[q][h]:.0f} %" for h in shown] for q in QUANTITIES})
        for row in rows for chance, of in row.items() if chance != "trajectory"])


def _tables(names, horizons, rows):
    """Of rows (names, {quantity: a cell a horizon})."""
    return [table([*((name, False) for name in names),
                   *((f"{q} {h.replace('h', 'h=')}", True) for q in pair for h in horizons)],
                  [[*map(escape, words), *(cell for q in pair for cell in cells[q])]
                   for words, cells in rows]) for pair in PAIRS]


def _cells(errors):
    """Of {quantity: {horizon: error}}; empty where nothing is stated."""
    return {q: [number(errors[q][h], 4) if h in errors[q] else "" for h in HORIZONS] for q in QUANTITIES}


def _published(summary):
    rows = []
    for p in summary["published"]:
        stated = {"sum": p["sums"], **{h: p[h] for h in HORIZONS if h in p}}
        rows.append(([p["name"], p["average"]], _cells(
            {q: {h: values[i] for h, values in stated.items()} for i, q in enumerate(QUANTITIES)})))
    for score in summary["scores"]:
        for average in AVERAGES:
            rows.append(([f"this run: {score['predictor']}, {score['trajectory']}", average],
                         _cells(score[average])))
    return _tables(("Model", "Average"), HORIZONS, rows)


def _curves(part, title):
    figure = make_subplots(rows=1, cols=4, subplot_titles=list(QUANTITIES.values()),
                           horizontal_spacing=0.05)
    for column, quantity in enumerate(QUANTITIES, start=1):
        for k, (predictor, curve) in enumerate(part.groupby("predictor", sort=False)):
            figure.add_trace(charts.lines(
                charts.rounded(curve.horizon), charts.rounded(curve[quantity], 5),
                charts.label(predictor), COLOURS[k % len(COLOURS)], legendgroup=predictor,
                showlegend=column == 1), row=1, col=column)
    charts.style(figure, 320, title=dict(text=title, x=0.0))
    figure.update_layout(margin=dict(t=120), legend=dict(y=1.2))
    figure.update_xaxes(title_text="Step of 10 ms")
    return figure


def _processes(fit):
    rows = []
    for name in fit["processes"]["level"]:
        cells = [fit["processes"][axis][name] for axis in ("level", "heading")]
        rows.append([f"<code>{escape(name)}</code>", *(
            escape(", ".join(number(x) for x in c)) if isinstance(c, list) else number(c)
            for c in cells)])
    return table([("Number", False), ("Roll and pitch", True), ("Yaw", True)], rows)
