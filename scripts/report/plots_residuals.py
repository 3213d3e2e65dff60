"""Whitened residuals of the fixes: over time, and their histogram against the standard normal."""
import math

import numpy as np
import plotly.graph_objects as go

import charts

POINTS = 4000  # drawn at most
AXES = {"r_x": ("x", "#1f6feb"), "r_y": ("y", "#e07b00"), "r_z": ("z", "#15803d")}


def whitened(result):
    """Residuals in units of their sigma, each fix once: from the first window that holds it.
    A frame with t, gate, sigma, weight and r_x, r_y, r_z (1); an axis without data is NaN."""
    rows = result.headline_rows(result.residuals).sort_values(["tau", "t"])
    rows = rows.drop_duplicates(["t", "gate"]).sort_values("t").copy()
    for axis in AXES:
        rows[axis] = rows[axis] / rows.sigma
    return rows


def over_time(residuals):
    figure = go.Figure()
    drawn = charts.decimate(residuals, POINTS)
    for column, (axis, colour) in AXES.items():
        rows = drawn.dropna(subset=[column])
        if rows.empty:
            continue
        figure.add_trace(go.Scatter(
            x=charts.rounded(rows.t), y=charts.rounded(rows[column]), name=axis, mode="markers",
            marker=dict(color=colour, size=4, opacity=0.6),
            customdata=np.stack([charts.rounded(rows[c]) for c in ("gate", "sigma", "weight")],
                                axis=-1),
            hovertemplate=f"{axis}: %{{y:.2f}} sigma<br>t %{{x:.2f}} s, gate %{{customdata[0]:.0f}}"
                          "<br>sigma %{customdata[1]:.2f} m, weight %{customdata[2]:.2f}"
                          "<extra></extra>"))
    for level in (-1.96, 1.96):
        figure.add_hline(y=level, line=dict(color=charts.MUTED, dash="dash", width=1))
    charts.style(figure, 340)
    figure.update_xaxes(title_text="Time from the first fix [s]")
    figure.update_yaxes(title_text="Residual / sigma", zeroline=True, zerolinecolor="#c6cfda")
    return figure


def histogram(residuals):
    """Density of the whitened residuals by axis; what lies beyond 6 sigma is in the outer bins."""
    edges = np.linspace(-6, 6, 49)
    centres = 0.5 * (edges[1:] + edges[:-1])
    figure = go.Figure()
    for column, (axis, colour) in AXES.items():
        values = residuals[column].dropna()
        if values.empty:
            continue
        counts, _ = np.histogram(values.clip(-5.999, 5.999), edges)
        density = counts / counts.sum() / (edges[1] - edges[0])
        figure.add_trace(go.Bar(x=centres, y=charts.rounded(density, 4), name=axis, opacity=0.5,
                                marker=dict(color=colour), customdata=counts,
                                hovertemplate=f"{axis}: %{{customdata}} fixes near %{{x:.2f}} sigma"
                                              "<extra></extra>"))
    normal_x = np.linspace(-6, 6, 121)
    normal = np.exp(-0.5 * normal_x**2) / math.sqrt(2 * math.pi)
    figure.add_trace(charts.lines(charts.rounded(normal_x), charts.rounded(normal, 4),
                                  "Standard normal (assumed)", charts.INK, hoverinfo="skip"))
    charts.style(figure, 340, barmode="overlay", bargap=0)
    figure.update_xaxes(title_text="Residual / sigma")
    figure.update_yaxes(title_text="Density", rangemode="tozero")
    return figure


def statistics(residuals):
    """By axis: name, count, mean, standard deviation, share within 1.96 sigma."""
    rows = []
    for column, (axis, _) in AXES.items():
        values = residuals[column].dropna()
        if not values.empty:
            rows.append((axis, len(values), values.mean(), values.std(ddof=0),
                         (values.abs() < 1.96).mean()))
    return rows
