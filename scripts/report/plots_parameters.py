"""Parameters by window with their 95 % intervals, as small multiples."""
import numpy as np
import plotly.graph_objects as go

import charts

SYMBOLS = {"identified": "circle", "weak": "circle-open", "unobservable": "x-thin-open",
           "at_bound": "triangle-up-open"}
WITHOUT_INTERVAL = ["unobservable", "at_bound"]  # their sigma is not one of an estimate


def parameters_by_window(result, truth=None):
    truth = truth or {}
    windows = result.windows[result.windows.gamma == result.gamma].dropna(subset=["value"])
    parameters = list(dict.fromkeys(windows.parameter))
    units = dict(zip(windows.parameter, windows.unit))
    figure, places, rows = charts.small_multiples([charts.unit_label(p, units[p]) for p in parameters], 90, 32 / 210)
    figure.update_layout(margin=dict(l=52))
    for index, (parameter, where) in enumerate(zip(parameters, places)):
        group = windows[windows.parameter == parameter]
        for estimator, history in group.groupby("estimator", sort=False):
            figure.add_trace(_history(estimator, history, index == 0), **where)
        known = [truth[parameter]] if parameter in truth else []
        for value in known:
            figure.add_hline(y=value, line=dict(color=charts.TRUTH, dash="dash", width=2), **where)
        figure.update_yaxes(range=_value_range(group, known), **where)
    figure.update_xaxes(title_text="End of window, from the first fix [s]", row=rows)
    return figure


def _history(estimator, history, in_legend):
    history = history.sort_values("t_end")
    shown = np.where(history.status.isin(WITHOUT_INTERVAL), np.nan, 1.96 * history.sigma)
    return go.Scatter(
        x=charts.rounded(history.t_end), y=charts.rounded(history.value, 6),
        error_y=dict(type="data", array=charts.rounded(shown, 6), thickness=1, width=2),
        mode="lines+markers", name=charts.label(estimator), legendgroup=estimator,
        showlegend=in_legend, line=dict(color=charts.colour(estimator), width=1),
        marker=dict(size=6, symbol=[SYMBOLS.get(s, "circle") for s in history.status]),
        customdata=np.stack([history.tau, history.status.str.replace("_", " "),
                             charts.rounded(history.sigma, 6)], axis=-1),
        hovertemplate=f"{charts.label(estimator)}, window %{{customdata[0]}}<br>%{{y:.4g}} ± "
                      "%{customdata[2]:.2g} (1 sigma)<br>%{customdata[1]}<extra></extra>")


def _value_range(group, more=()):
    """All values and the usual interval; a few very wide intervals may leave the picture."""
    known = group[group.status.isin(["identified", "weak"])]
    half = 1.96 * np.nanmedian(known.sigma) if known.sigma.notna().any() else 0.0
    low, high = group.value.min() - half, group.value.max() + half
    low, high = min([low, *more]), max([high, *more])
    margin = 0.08 * (high - low) or 0.1 * abs(high) or 0.1
    return [low - margin, high + margin]
