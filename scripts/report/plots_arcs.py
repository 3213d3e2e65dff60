"""Errors of the predicted arcs: by arc, and against the window length gamma (Li et al. 2019,
fig. 11)."""
import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

import charts


def errors_by_arc(result):
    """Final-point error of each arc at the headline's gamma; a ring marks an error outside its
    95 % ellipse."""
    figure = go.Figure()
    arcs = result.arcs[result.arcs.gamma == result.gamma].dropna(subset=["final_point_error"])
    for estimator, rows in arcs.groupby("estimator", sort=False):
        rows = rows.sort_values("tau")
        _add_errors(figure, estimator, rows)
        if estimator == result.estimator:
            figure.add_trace(charts.lines(
                rows.tau, charts.rounded(rows.predicted_sigma), "Predicted sigma", charts.MUTED,
                dash="dot", width=1.5, hovertemplate="arc %{x}: predicted sigma %{y:.2f} m"
                                                     "<extra></extra>"))
    outside = arcs[arcs.inside_95 == 0]
    if not outside.empty:
        figure.add_trace(go.Scatter(
            x=outside.tau, y=charts.rounded(outside.final_point_error), mode="markers",
            name="Outside its 95 % ellipse", hoverinfo="skip",
            marker=dict(color=charts.BAD, size=14, symbol="circle-open", line=dict(width=2))))
    charts.style(figure, 360)
    figure.update_xaxes(title_text="Arc (tau)")
    figure.update_yaxes(title_text="Final-point error [m]", rangemode="tozero")
    return figure


def _add_errors(figure, estimator, rows):
    details = np.stack([charts.rounded(rows[c]) for c in
                        ("t_start", "t_end", "predicted_sigma", "iterations")], axis=-1)
    figure.add_trace(go.Scatter(
        x=rows.tau, y=charts.rounded(rows.final_point_error), name=charts.label(estimator),
        mode="lines+markers", marker=dict(size=7), customdata=details,
        line=dict(color=charts.colour(estimator), width=1.5),
        hovertemplate=f"{charts.label(estimator)}, arc %{{x}}<br>error %{{y:.3f}} m<br>"
                      "predicted sigma %{customdata[2]:.3f} m<br>t %{customdata[0]:.2f} to "
                      "%{customdata[1]:.2f} s<br>%{customdata[3]:.0f} iterations<extra></extra>"))


def against_gamma(result):
    """Left: final-point error against gamma. Right: solver iterations against gamma. A point is
    an arc; lines join the means, diamonds are medians."""
    figure = make_subplots(cols=2, horizontal_spacing=0.1)
    arcs = result.arcs
    estimators = list(dict.fromkeys(arcs.estimator))
    for index, estimator in enumerate(estimators):
        shift = 0.16 * (index - 0.5 * (len(estimators) - 1))
        rows = arcs[arcs.estimator == estimator]
        _add_distribution(figure, estimator, rows, "final_point_error", 1, shift, "m")
        iterated = rows[rows.iterations > 0]  # a filter has none
        _add_distribution(figure, estimator, iterated, "iterations", 2, shift, "iterations")
    charts.style(figure, 380)
    figure.update_xaxes(title_text="Window length gamma [passes]", dtick=1)
    figure.update_yaxes(title_text="Final-point error [m]", rangemode="tozero", col=1)
    figure.update_yaxes(title_text="Iterations", rangemode="tozero", col=2)
    return figure


def _add_distribution(figure, estimator, rows, column, subplot, shift, unit):
    rows = rows.dropna(subset=[column])
    if rows.empty:
        return
    colour, name, first = charts.colour(estimator), charts.label(estimator), subplot == 1
    groups = rows.groupby("gamma")[column]
    spread = 0.05 * np.sin(12.9898 * rows.tau)  # by arc, so that equal values do not overlap
    traces = [
        go.Scatter(x=charts.rounded(rows.gamma + shift + spread), y=charts.rounded(rows[column]),
                   mode="markers", marker=dict(color=colour, size=5, opacity=0.35),
                   name=f"{name}, arcs", customdata=rows.tau,
                   hovertemplate=f"{name}, arc %{{customdata}}: %{{y:.3~f}} {unit}<extra></extra>"),
        *charts.mean_and_median(groups, shift, colour, f"{name}, ", unit)]
    for trace in traces:
        trace.update(legendgroup=trace.name, showlegend=first)
        figure.add_trace(trace, row=1, col=subplot)
