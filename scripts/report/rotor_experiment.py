"""The page of an experiment with rotor-driven flights: figures 1 and 3 of Boehm et al. 2020."""
from plotly.subplots import make_subplots

import charts
from csv_table import read_table
from page import Page, escape, paragraph
from tables import number, percent, table
from yaml_file import read_mapping

AXES = {"x": "#1f6feb", "y": "#c0312b", "z": "#15803d"}
KINDS = ["#c0312b", "#8a94a3", "#1f6feb", "#15803d", "#b0389a", "#e07b00"]
GROUPS = ["m", "I", "r_BM", "r_BP", "r_BI", "b_a", "b_w"]
ROW_HEIGHT = 190


def build(arguments):
    summary = read_mapping(arguments.result / "summary.yaml")
    history = read_table(arguments.result / "history.csv",
                         ["t", "truth", "mean_error", "spread", "rmse", "sigma"],
                         ["kind", "parameter", "unit"])
    history["group"] = history.parameter.map(_group)
    page = Page(str(summary["name"]), str(summary.get("about", "")))
    page.add("table", "Errors at the end", *_tables(summary["kinds"]))
    page.add("figure-1", "Figure 1: RMSE over time", paragraph(
        "Length of the filter's error vector, root mean square over the flights of a kind.", "note"),
        charts.embed(_rmse(history), "plot-rmse"))
    page.add("figure-3", "Figure 3: estimates over time", paragraph(
        "Mean of the filter's estimates over the flights; shaded: one standard deviation between "
        "flights; dotted: the truth. x blue, y red, z green.", "note"),
        charts.embed(_estimates(history), "plot-estimates"))
    return page


def _group(parameter):
    return parameter[:-2] if parameter[-2:] in ("_x", "_y", "_z") else parameter


def _tables(kinds):
    headers = [("", False), ("Filter RMSE", True), ("sigma", True), ("in 95 %", True),
               ("Batch RMSE", True), ("sigma", True), ("in 95 %", True), ("Bound", True),
               ("First guess", True), ("Unit", False)]
    blocks = []
    for kind in kinds:
        rows = [_row(name, score) for part in ("constants", "groups")
                for name, score in (kind.get(part) or {}).items()]
        over, nees = kind["rmse_over_bound"], kind["nees"]
        blocks += [f"<h3>{escape(kind['name'])}, {kind['flights']} flights</h3>",
                   table(headers, rows),
                   paragraph(f"RMSE over the Cramer-Rao bound: filter {number(over['filter'])}, "
                             f"batch {number(over['batch'])}. NEES by degree of freedom (1 where "
                             f"consistent): {number(nees['filter'])}, {number(nees['batch'])}.",
                             "note")]
    return blocks


def _row(name, score):
    cells = [f"<code>{escape(name)}</code>"]
    for estimator in ("filter", "batch"):
        entry = score[estimator]
        cells += [number(entry["rmse"]), number(entry["sigma"]), percent(entry["coverage95"])]
    return cells + [number(score["bound"]), number(score["first_guess"]), escape(score["unit"])]


def _rmse(history):
    groups = [g for g in GROUPS if g in set(history.group)]
    units = dict(zip(history.group, history.unit))
    columns = 2
    rows = -(-len(groups) // columns)
    figure = make_subplots(rows=rows, cols=columns, vertical_spacing=0.28 / rows,
                           subplot_titles=[charts.unit_label(g, units[g]) for g in groups])
    for index, group in enumerate(groups):
        for k, kind in enumerate(dict.fromkeys(history.kind)):
            part = history[(history.group == group) & (history.kind == kind)]
            length = (part.rmse ** 2).groupby(part.t).sum() ** 0.5
            figure.add_trace(
                charts.lines(charts.rounded(length.index), charts.rounded(length, 8),
                             charts.label(kind), KINDS[k % len(KINDS)], legendgroup=kind,
                             showlegend=index == 0),
                row=index // columns + 1, col=index % columns + 1)
    charts.style(figure, 100 + ROW_HEIGHT * rows)
    figure.update_yaxes(type="log")
    figure.update_annotations(font=dict(size=13, color=charts.INK))
    figure.update_xaxes(title_text="Flight [s]", row=rows)
    return figure


def _estimates(history):
    groups = [g for g in GROUPS if g in set(history.group)]
    kinds = list(dict.fromkeys(history.kind))
    units = dict(zip(history.group, history.unit))
    figure = make_subplots(
        rows=len(groups), cols=len(kinds), shared_xaxes=True, shared_yaxes="rows",
        vertical_spacing=0.02, horizontal_spacing=0.02,
        column_titles=[charts.label(kind) for kind in kinds])
    for row, group in enumerate(groups, start=1):
        for column, kind in enumerate(kinds, start=1):
            part = history[(history.group == group) & (history.kind == kind)]
            for parameter, curve in part.groupby("parameter", sort=False):
                for trace in _curve(parameter, curve):
                    figure.add_trace(trace, row=row, col=column)
        figure.update_yaxes(title_text=charts.unit_label(group, units[group]), row=row, col=1)
        figure.update_yaxes(range=_range(history[history.group == group]), row=row)
    charts.style(figure, 80 + ROW_HEIGHT * len(groups), showlegend=False)
    figure.update_xaxes(title_text="Flight [s]", row=len(groups))
    return figure


def _range(part):
    """What is left after the first two seconds, in which the first guesses fade."""
    late = part[part.t > 2.0]
    value = late.truth + late.mean_error
    half = late.spread
    low = min((value - half).min(), late.truth.min())
    high = max((value + half).max(), late.truth.max())
    margin = 0.08 * (high - low) or 1e-6
    return [low - margin, high + margin]


def _curve(parameter, curve):
    colour = AXES.get(parameter[-1], AXES["x"])
    t, value = charts.rounded(curve.t), curve.truth + curve.mean_error
    low, high = (charts.rounded(value + k * curve.spread, 8) for k in (-1, 1))
    return [
        charts.band(t, low, high, colour, 0.15),
        charts.lines(t, charts.rounded(value, 8), parameter, colour),
        charts.lines(t, charts.rounded(curve.truth, 8), f"{parameter}, truth", colour, dash="dot",
                     width=1)]
