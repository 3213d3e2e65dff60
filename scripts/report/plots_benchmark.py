"""Charts of a benchmark, in the manner of figures 11 to 13 of Li et al. 2019."""
import html

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from plotly.subplots import make_subplots

import charts
from charts import INK, MUTED, rounded

DOTS = "#b9c0ca"
MOST_DOTS = 1500  # of one panel
DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"]


def _most(rows, column="final_point_error"):
    """Upper end of an axis: far outliers stay outside of the picture."""
    return 1.15 * float(rows[column].quantile(0.99)) if len(rows) else 1.0


def _floor(x, y, **more):
    return go.Scatter(x=x, y=rounded(y), mode="lines", name="Cramer-Rao bound",
                      line=dict(color=INK, dash="dash", width=1.5), legendgroup="bound",
                      hovertemplate="bound %{y:.3f} m<extra></extra>", **more)


def against_gamma(result):
    """Figure 11: a column for each label; errors above, iterations below."""
    labels = [label for label in result.labels
              if result.arcs[result.arcs.label == label].gamma.nunique() > 1]
    titles = [html.escape(label) for label in labels]
    figure = make_subplots(rows=2, cols=len(labels), subplot_titles=titles, shared_yaxes=True,
                           shared_xaxes=True, horizontal_spacing=0.04, vertical_spacing=0.08)
    for column, label in enumerate(labels, 1):
        rows = result.arcs[result.arcs.label == label]
        _distribution(figure, rows, "final_point_error", result.colour(label), 1, column)
        _distribution(figure, result.all_arcs[result.all_arcs.label == label], "iterations",
                      result.colour(label), 2, column)
        bound = rows.dropna(subset=["bound"]).groupby("gamma").bound.mean()
        if len(bound):
            figure.add_trace(_floor(bound.index, bound, showlegend=column == 1), 1, column)
    charts.style(figure, 640, margin=dict(l=64, r=16, t=56, b=48), legend=dict(
        orientation="h", x=1, y=1.05, xanchor="right", yanchor="bottom"))
    figure.update_xaxes(title_text="Window length gamma [passes]", dtick=1, row=2)
    figure.update_yaxes(title_text="Final-point error [m]", row=1, col=1)
    figure.update_yaxes(range=[0, _most(result.arcs)], row=1)
    figure.update_yaxes(title_text="Iterations", row=2, col=1)
    figure.update_yaxes(range=[0, 1.15 * result.all_arcs.iterations.quantile(0.995)], row=2)
    return figure


def _distribution(figure, rows, column, colour, row, subplot):
    groups = rows.groupby("gamma")[column]
    dots = charts.decimate(rows, MOST_DOTS)
    spread = 0.22 * np.sin(12.9898 * np.arange(len(dots)))  # so that equal values do not overlap
    first = row == 1 and subplot == 1
    unit = "m" if row == 1 else "iterations"
    for trace in [
            go.Scatter(x=rounded(dots.gamma + spread), y=rounded(dots[column]), mode="markers",
                       name="arcs", marker=dict(color=DOTS, size=4), hoverinfo="skip"),
            *charts.mean_and_median(groups, 0, colour, "", unit)]:
        trace.update(legendgroup=trace.name, showlegend=first)
        figure.add_trace(trace, row, subplot)


def _band(figure, label, x, low, middle, high, colour, show, place):
    """A median with its interquartile band."""
    name = html.escape(label)
    figure.add_trace(charts.band(x, rounded(low), rounded(high), colour, 0.15, name=name, legendgroup=name,
                                 showlegend=False), *place)
    figure.add_trace(go.Scatter(
        x=x, y=rounded(middle), mode="lines+markers", name=name, line=dict(color=colour, width=2),
        marker=dict(size=6), legendgroup=name, showlegend=show,
        hovertemplate=f"{name}: median %{{y:.3f}} m<extra></extra>"), *place)


def _quartiles(rows, key, column="final_point_error"):
    groups = rows.groupby(key)[column]
    return (groups.median().index.to_numpy(), groups.quantile(0.25).to_numpy(),
            groups.median().to_numpy(), groups.quantile(0.75).to_numpy())


def _panels(result, title):
    """A panel for each log."""
    figure = make_subplots(rows=len(result.logs), cols=1, vertical_spacing=0.35 / (
        len(result.logs) + 3), subplot_titles=[html.escape(x) for x in result.logs]
        if len(result.logs) > 1 else None)
    charts.style(figure, 120 + 280 * len(result.logs), margin=dict(l=64, r=16, t=64, b=48),
                 legend=charts.legend_at(1.0 + 0.11 / len(result.logs)))
    figure.update_xaxes(title_text=title, row=len(result.logs))
    figure.update_yaxes(title_text="Final-point error [m]")
    return figure


def by_arc(result):
    """Figure 12: error by arc for each label, at the headline's gamma."""
    figure = _panels(result, "Arc (tau)")
    _add_bands(figure, result, "tau")
    _scale_errors(figure, result, "tau")
    return figure


def _add_bands(figure, result, key):
    for panel, log in enumerate(result.logs, 1):
        shown = []
        for label in result.labels:
            rows = result.headline(label)
            rows = rows[(rows.log == log) & rows[key].notna()]
            if rows.empty:
                continue
            shown.append(rows)
            x, low, middle, high = _quartiles(rows, key)
            _band(figure, label, x, low, middle, high, result.colour(label), panel == 1, (panel, 1))
        _add_floor(figure, shown, key, panel)


def _add_floor(figure, shown, key, panel):
    """The lowest of the labels' bounds: that of the model with least unknowns."""
    bounds = [rows.dropna(subset=["bound"]).groupby(key).bound.median() for rows in shown]
    bounds = [bound for bound in bounds if len(bound)]
    if not bounds:
        return
    lowest = bounds[0].to_frame("0").join([b.rename(str(i)) for i, b in enumerate(bounds[1:], 1)],
                                          how="outer").min(axis=1)
    figure.add_trace(_floor(lowest.index, lowest, showlegend=panel == 1), panel, 1)


def over_sweep(result):
    """Median error against the sweep's value, with interquartile bands."""
    sweep = result.summary.get("sweep") or {}
    figure = _panels(result, charts.unit_label(str(sweep.get("name", "sweep")),
                                               str(sweep.get("unit", ""))))
    values = result.arcs["sweep"].dropna()
    logarithmic = values.min() > 0 and values.max() / values.min() > 8
    _add_bands(figure, result, "sweep")
    if logarithmic:
        ticks = sorted(values.unique())
        figure.update_xaxes(type="log", tickvals=ticks, ticktext=[f"{t:g}" for t in ticks])
    _scale_errors(figure, result, "sweep")
    return figure


def _scale_errors(figure, result, key):
    """A logarithmic axis where the medians span more than an order of magnitude."""
    medians = pd.concat([result.headline(label).groupby(["log", key]).final_point_error.median()
                         for label in result.labels])
    if len(medians) and medians.max() > 10 * max(1e-3, medians.min()):
        figure.update_yaxes(type="log", dtick="D2")
    else:
        figure.update_yaxes(rangemode="tozero")


def by_log(result):
    """Boxes of the error for each log and label."""
    figure = go.Figure()
    for label in result.labels:
        rows = result.headline(label)
        figure.add_trace(go.Box(
            x=rows.log.map(html.escape), y=rounded(rows.final_point_error),
            name=html.escape(label), marker=dict(color=result.colour(label), size=4),
            line=dict(width=1.5)))
    charts.style(figure, 420, boxmode="group")
    rows = result.arcs
    bound = rows.dropna(subset=["bound"]).groupby("log", sort=False).bound.median()
    if len(bound):
        figure.add_trace(go.Scatter(
            x=[html.escape(x) for x in bound.index], y=rounded(bound), mode="markers",
            name="Cramer-Rao bound", marker=dict(symbol="line-ew", size=60, line=dict(
                color=INK, width=2)), hovertemplate="bound %{y:.3f} m<extra></extra>"))
    figure.update_yaxes(title_text="Final-point error [m]", range=[0, _most(rows)])
    return figure


def track(result):
    """Figure 13: the whole flight from above, a panel for each label."""
    paths = result.paths
    truth, fixes = (paths[paths.label == name] for name in ("truth", "fixes"))
    labels = [x for x in dict.fromkeys(paths.label) if x not in ("truth", "fixes")]
    columns = min(3, len(labels))
    rows = -(-len(labels) // columns)
    figure = make_subplots(rows, columns, subplot_titles=[html.escape(x) for x in labels],
                           horizontal_spacing=0.05, vertical_spacing=0.16 / rows)
    for index, label in enumerate(labels):
        place = (index // columns + 1, index % columns + 1)
        _add_flown(figure, truth, fixes, index == 0, place)
        _add_estimated(figure, paths[paths.label == label], result.colour(label), index == 0, place)
    charts.style(figure, 80 + 420 * rows, margin=dict(l=64, r=16, t=84, b=48),
                 legend=charts.legend_at(1.0 + 0.1 / rows))
    span, margin = truth if len(truth) else fixes, 1.0
    for index in range(len(labels)):
        figure.update_xaxes(range=[span.y.min() - margin, span.y.max() + margin],
                            scaleanchor=f"y{index + 1 if index else ''}", scaleratio=1,
                            title_text="y, east [m]", row=index // columns + 1,
                            col=index % columns + 1)
    figure.update_yaxes(range=[span.x.min() - margin, span.x.max() + margin])
    figure.update_yaxes(title_text="x, north [m]", col=1)
    return figure


def _add_flown(figure, truth, fixes, show, place):
    if len(truth):
        pieces = charts.in_pieces(charts.split_at_gaps(truth, 0.5), ["x", "y"])
        figure.add_trace(charts.lines(pieces["y"], pieces["x"], "Truth (mocap)", charts.TRUTH,
                                      width=3, legendgroup="truth", showlegend=show), *place)
    figure.add_trace(go.Scatter(
        x=rounded(fixes.y), y=rounded(fixes.x), name="Fixes", mode="markers", legendgroup="fixes",
        showlegend=show, marker=dict(color=charts.FIXES, size=3)), *place)


def _add_estimated(figure, path, colour, show, place):
    for kind, name, dash in (("fit", "Fitted", "solid"), ("prediction", "Predicted blind", "dot")):
        windows = [piece for _, piece in path[path.kind == kind].groupby("tau")]
        if not windows:
            continue
        pieces = charts.in_pieces(windows, ["x", "y"])
        figure.add_trace(charts.lines(pieces["y"], pieces["x"], name, colour, dash=dash, width=1.5,
                                      legendgroup=name, showlegend=show), *place)


def _curves(rows, sweep):
    """(name, dash, rows) of a label: one for each window length and value of the sweep."""
    several = {key: rows[key].nunique() > 1 for key in ("gamma", "sweep")}
    curves = []
    for (gamma, value), part in rows.groupby(["gamma", "sweep"], dropna=False):
        name = part.label.iloc[0]
        if several["gamma"]:
            name += f", gamma {gamma:g}"
        if several["sweep"]:
            name += f", {sweep} {value:g}"
        curves.append((html.escape(name), DASHES[len(curves) % len(DASHES)], part))
    return curves


def convergence(result):
    """Share of flights converged against time, a panel for each quantity."""
    sweep = (result.summary.get("sweep") or {}).get("name", "sweep")
    rows = result.convergence
    quantities = list(dict.fromkeys(rows.quantity))
    figure = make_subplots(rows=1, cols=len(quantities), shared_yaxes=True,
                           subplot_titles=[html.escape(q) for q in quantities],
                           horizontal_spacing=0.03)
    named = set()
    for column, quantity in enumerate(quantities, 1):
        for label in dict.fromkeys(rows.label):
            for name, dash, part in _curves(rows[rows.label == label], sweep):
                times = part[part.quantity == quantity].time
                if times.empty:
                    continue
                figure.add_trace(_share_converged(times, name, result.colour(label), dash,
                                                  name not in named), 1, column)
                named.add(name)
    charts.style(figure, 380, margin=dict(l=64, r=16, t=72, b=48), legend=charts.legend_at(1.12))
    figure.update_xaxes(title_text="Time since the first fix [s]", rangemode="tozero")
    figure.update_yaxes(range=[0, 1.02], tickformat=".0%")
    figure.update_yaxes(title_text="Flights converged", col=1)
    for annotation in figure.layout.annotations:
        annotation.font = dict(size=13, color=MUTED)
    return figure


def _share_converged(times, name, colour, dash, show):
    reached = np.sort(times.dropna().to_numpy())
    share = np.arange(1, len(reached) + 1) / len(times)
    return go.Scatter(
        x=rounded([0, *reached], 2), y=rounded([0, *share]), mode="lines", name=name,
        line=dict(color=colour, width=2, dash=dash, shape="hv"), legendgroup=name, showlegend=show,
        hovertemplate=f"{name}: %{{y:.0%}} by %{{x:.1f}} s<extra></extra>")
