"""The page of trueline calibrate --drive=rotors: verdict, constants, estimates over time, track."""
from dataclasses import dataclass
import pandas as pd
import plotly.graph_objects as go

import charts
from calibration_sections import headline, parameter_table, provenance, unobservable
from csv_table import read_table
from page import Page, paragraph
from tables import number, percent, table
from yaml_file import read_mapping

COLOURS = {"filter": "#1f6feb", "batch": "#e07b00"}


@dataclass
class RotorResult:
    summary: dict
    windows: pd.DataFrame
    trajectory: pd.DataFrame

    @property
    def verdict(self):
        return self.summary["verdict"]


def build(arguments):
    folder = arguments.result
    result = RotorResult(
        read_mapping(folder / "calibration.yaml"),
        read_table(folder / "windows.csv", ["t_start", "t_end", "value", "sigma"],
                   ["estimator", "parameter", "unit", "status"]),
        read_table(folder / "trajectory.csv", ["t", "x", "y", "z"]))
    page = Page("Calibration by rotor speeds", str(result.summary["provenance"].get("log", "")))
    page.add("verdict", "Result", *headline(result, "--drive=rotors --config=CONFIG "), _predictions(result))
    page.add("parameters", "Constants", parameter_table(result.summary.get("parameters")),
             unobservable(result.summary))
    page.add("time", "Over time", paragraph(
        "The filter's estimates with one sigma (shaded), and the batch fit of the whole flight with "
        "its 95 % interval at the end.", "note"), _contradictions(result.windows),
        charts.embed(_over_time(result), "plot-time"))
    page.add("track", "Track", charts.embed(_track(result), "plot-track"))
    page.add("provenance", "Provenance", *provenance(result))
    return page


def _predictions(result):
    rows = [[f"{s['horizon']:g}", number(s["before"]), number(s["after"]), number(s["after_rms"]),
             *(percent(s[f"inside_{level}"]) for level in (50, 90, 95)),
             number(s["region_95"]), percent(s["inside_95_by_noise"]), str(s["count"])]
            for s in result.summary.get("open_loop") or []]
    if not rows:
        return ""
    return "<h3>Open-loop prediction on held-out flight</h3>" + table(
        [("Horizon [s]", True), ("Nominal vehicle, mean [m]", True), ("Calibrated, mean [m]", True),
         ("RMS [m]", True), ("In 50 %", True), ("In 90 %", True), ("In 95 %", True),
         ("95 % region [m]", True), ("In 95 % of the noise", True), ("Starts", True)], rows) + paragraph(
             "Regions are learned on the fitted part of the flight. Where far fewer errors lie inside "
             "the 95 % region of the noise, the model lacks something.", "note")


def _contradictions(windows):
    """Names constants of which filter and batch state intervals that do not meet."""
    last = windows[windows.estimator == "filter"].groupby("parameter").last()
    batch = windows[windows.estimator == "batch"].groupby("parameter").last()
    both = last.join(batch, lsuffix="_filter", rsuffix="_batch", how="inner")
    apart = (both.value_filter - both.value_batch).abs() > 1.96 * (both.sigma_filter + both.sigma_batch)
    if not apart.any():
        return ""
    return paragraph("Filter and batch contradict each other by their 95 % intervals in "
                     f"{', '.join(both.index[apart])}. The batch counts: it linearises at its solution, and a "
                     "disturbance that lasts is noise to the filter. Both may be too sure.", "warnings")


def _over_time(result):
    windows = result.windows
    start = windows.t_start.min()
    parameters = list(dict.fromkeys(windows.parameter))
    units = dict(zip(windows.parameter, windows.unit))
    figure, places, rows = charts.small_multiples([charts.unit_label(p, units[p]) for p in parameters], 110, 0.16)
    for index, (name, where) in enumerate(zip(parameters, places)):
        group = windows[windows.parameter == name]
        figure.add_traces(_band(group[group.estimator == "filter"], start, index == 0),
                          rows=[where["row"]] * 2, cols=[where["col"]] * 2)
        figure.add_trace(_end(group[group.estimator == "batch"], start, index == 0), **where)
    figure.update_xaxes(title_text="Flight [s]", row=rows)
    return figure


def _band(history, start, in_legend):
    t = charts.rounded(history.t_end - start)
    low, value, high = (charts.rounded(history.value + k * history.sigma, 8) for k in (-1, 0, 1))
    return [charts.band(t, low, high, COLOURS["filter"], 0.18, showlegend=False),
            charts.lines(t, value, "Filter", COLOURS["filter"], showlegend=in_legend, legendgroup="filter")]


def _end(batch, start, in_legend):
    return go.Scatter(x=charts.rounded(batch.t_end - start), y=charts.rounded(batch.value, 8),
                      error_y=dict(type="data", array=charts.rounded(1.96 * batch.sigma, 8)),
                      mode="markers", name="Batch", legendgroup="batch", showlegend=in_legend,
                      marker=dict(color=COLOURS["batch"], size=8))


def _track(result):
    frame = charts.decimate(result.trajectory, 4000)
    figure = go.Figure(charts.lines(charts.rounded(frame.y), charts.rounded(frame.x), "Fitted path",
                                    COLOURS["filter"]))
    charts.style(figure, 480)
    figure.update_xaxes(title_text="East [m]")
    figure.update_yaxes(title_text="North [m]", scaleanchor="x")
    return figure
