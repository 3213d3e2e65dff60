"""States and biases of one flight over time, against the truth (figs. 12 and 13 of Li et al. 2019)."""
import html

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

import charts
from charts import rounded

STATES = {"x": "x, north [m]", "y": "y, east [m]", "z": "z, down [m]",
          "vx": "v north [m/s]", "vy": "v east [m/s]", "vz": "v down [m/s]"}
BIASES = (("accel-bias", "Accelerometer bias", ("b_ax", "b_ay", "b_az")),
          ("gyro-bias", "Gyroscope bias", ("b_gx", "b_gy", "b_gz")))


def has(result, names):
    return result.estimates.name.isin(names).any()


def states(result):
    """Position and velocity, a row for each component."""
    paths = result.paths
    truth, fixes = (paths[paths.label == name] for name in ("truth", "fixes"))
    figure = make_subplots(rows=len(STATES), cols=1, shared_xaxes=True, vertical_spacing=0.02)
    for row, (column, title) in enumerate(STATES.items(), 1):
        if len(truth):
            figure.add_trace(_line(charts.split_at_gaps(truth, 0.5), column, "Truth (mocap)",
                                   charts.TRUTH, "solid", 3, row == 1), row, 1)
        if column in "xyz" and len(fixes):
            figure.add_trace(go.Scatter(
                x=rounded(fixes.t), y=rounded(fixes[column]), mode="markers", name="Fixes",
                legendgroup="Fixes", showlegend=row == 1,
                marker=dict(color=charts.FIXES, size=3)), row, 1)
        for label in result.labels:
            _add_path(figure, paths[paths.label == label], column, label, result.colour(label), row)
        shown = truth if len(truth) else paths[paths.label != "fixes"]
        figure.update_yaxes(title_text=title, range=_range(shown[column]), row=row, col=1)
    charts.style(figure, 150 * len(STATES) + 90, margin=dict(l=64, r=16, t=64, b=48))
    figure.update_xaxes(title_text="t [s]", row=len(STATES), col=1)
    return figure


def _add_path(figure, path, column, label, colour, row):
    """Passes are solid, predicted arcs dotted."""
    for kind, dash in (("fit", "solid"), ("prediction", "dot")):
        pieces = [piece for _, piece in path[path.kind == kind].groupby("tau")]
        if pieces:
            figure.add_trace(_line(pieces, column, label, colour, dash, 1.5,
                                   row == 1 and kind == "fit"), row, 1)


def _line(pieces, column, name, colour, dash, width, show):
    joined = charts.in_pieces(pieces, ["t", column])
    return charts.lines(joined["t"], joined[column], html.escape(name), colour, dash=dash,
                        width=width, legendgroup=html.escape(name), showlegend=show)


def _range(values):
    """The truth's range and half as much beside: a diverged prediction leaves the picture."""
    low, high = np.nanmin(values), np.nanmax(values)
    margin = max(0.5 * (high - low), 0.5)
    return [low - margin, high + margin]


def estimates(result, names):
    """Estimates of some parameters by label, a row for each parameter."""
    rows = result.estimates[result.estimates.name.isin(names)]
    shown = [name for name in names if (rows.name == name).any()]
    figure = make_subplots(rows=len(shown), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    named = set()
    for row, name in enumerate(shown, 1):
        group = rows[rows.name == name]
        for label in dict.fromkeys(group.label):
            history = group[group.label == label].sort_values("t")
            _add_band(figure, history, label, result.colour(label), label not in named, row)
            named.add(label)
        _add_truth(figure, group, row)
        figure.update_yaxes(title_text=charts.unit_label(name, group.unit.iloc[0]),
                            range=_usual_range(group), row=row, col=1)
    charts.style(figure, 180 * len(shown) + 90, margin=dict(l=72, r=16, t=64, b=48))
    figure.update_xaxes(title_text="t [s]", row=len(shown), col=1)
    return figure


def _add_band(figure, history, label, colour, show, row):
    name = html.escape(label)
    t, value, sigma = (rounded(history[c], 6) for c in ("t", "value", "sigma"))
    figure.add_trace(charts.band(t, value - sigma, value + sigma, colour, 0.12, legendgroup=name,
                                 showlegend=False), row, 1)
    figure.add_trace(charts.lines(t, value, name, colour, width=2, legendgroup=name,
                                  showlegend=show), row, 1)


def _add_truth(figure, group, row):
    truth = group.truth.dropna()
    if len(truth):
        figure.add_hline(y=truth.iloc[0], row=row, col=1,
                         line=dict(color=charts.TRUTH, dash="dash", width=2))


def _usual_range(group):
    """Nine tenths of all values, and the truth."""
    values = group.value.dropna()
    low, high = np.quantile(values, [0.05, 0.95])
    known = group.truth.dropna()
    low, high = min([low, *known]), max([high, *known])
    margin = 0.2 * (high - low) or 0.1 * abs(high) or 0.1
    return [low - margin, high + margin]
