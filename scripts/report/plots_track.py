"""The track from above. NED: y (east) to the right, x (north) upwards."""
import html
import math

import numpy as np
import plotly.graph_objects as go

import charts

# Points drawn at most, so that a page of an hour's flight stays small.
PATH_POINTS, MOCAP_POINTS, FIX_POINTS = 12000, 4000, 4000
GATE_WIDTH = 1.0      # m, as drawn
MOCAP_GAP = 0.5       # s, longer gaps are not bridged by a line
CHI2_95 = 5.991       # 95 % quantile of chi-squared with two degrees of freedom


def ellipse_95(row, points=33):
    """(x, y) of the 95 % ellipse round the predicted point; empty where there is no covariance."""
    covariance = np.array([[row.cov_xx, row.cov_xy], [row.cov_xy, row.cov_yy]])
    if not np.isfinite(covariance).all():
        return np.empty(0), np.empty(0)
    variances, axes = np.linalg.eigh(covariance)
    angle = np.linspace(0, 2 * math.pi, points)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    x, y = axes @ (np.sqrt(CHI2_95 * np.maximum(variances, 0))[:, None] * circle)
    return row.x_predicted + x, row.y_predicted + y


def track(result, log):
    figure = go.Figure()
    _add_truth(figure, log)
    _add_fixes(figure, log)
    estimators = list(dict.fromkeys(result.trajectory.estimator))
    for estimator in estimators:
        shown = True if estimator == result.estimator else "legendonly"
        _add_paths(figure, result, estimator, shown, PATH_POINTS // (2 * len(estimators)))
    for estimator in dict.fromkeys(result.arcs.estimator):
        shown = True if estimator == result.estimator else "legendonly"
        _add_final_points(figure, result, estimator, shown)
    _add_gates(figure, log)
    charts.style(figure, 640, margin=dict(l=64, r=16, t=16, b=48),
                 legend=dict(orientation="v", x=1.01, y=1, xanchor="left", yanchor="top"))
    figure.update_xaxes(title_text="y, east [m]", constrain="domain")
    figure.update_yaxes(title_text="x, north [m]", scaleanchor="x", scaleratio=1, constrain="domain")
    return figure


def _add_truth(figure, log):
    if log.mocap.empty:
        return
    mocap = charts.decimate(log.mocap, MOCAP_POINTS)
    step = np.median(np.diff(mocap.t)) if len(mocap) > 1 else 0
    path = charts.in_pieces(charts.split_at_gaps(mocap, max(MOCAP_GAP, 5 * step)), ["t", "x", "y"])
    figure.add_trace(charts.lines(
        path["y"], path["x"], "Mocap", charts.TRUTH, width=1.5, customdata=path["t"],
        hovertemplate="Mocap<br>t %{customdata:.2f} s<br>x %{y:.2f}, y %{x:.2f} m<extra></extra>"))


def _add_fixes(figure, log):
    if log.fixes.empty:
        return
    fixes = charts.decimate(log.fixes, FIX_POINTS)
    figure.add_trace(go.Scatter(
        x=charts.rounded(fixes.y), y=charts.rounded(fixes.x), name="Fixes", mode="markers",
        marker=dict(color=charts.FIXES, size=4, opacity=0.7),
        customdata=np.stack([charts.rounded(fixes[c]) for c in ("t", "gate", "sigma")], axis=-1),
        hovertemplate="Fix of gate %{customdata[1]:.0f}<br>t %{customdata[0]:.2f} s<br>"
                      "x %{y:.2f}, y %{x:.2f} m<br>sigma %{customdata[2]:.2f} m<extra></extra>"))


def _add_paths(figure, result, estimator, shown, limit):
    rows = result.trajectory[result.trajectory.estimator == estimator]
    for kind, dash, what in (("fit", "solid", "fitted"), ("prediction", "dot", "predicted")):
        group = rows[rows.kind == kind]
        if group.empty:
            continue
        per_point = limit / len(group)
        pieces = [charts.decimate(piece, max(8, int(per_point * len(piece))))
                  for _, piece in group.groupby("tau")]
        path = charts.in_pieces(pieces, ["t", "tau", "x", "y"])
        figure.add_trace(charts.lines(
            path["y"], path["x"], f"{charts.label(estimator)}, {what}", charts.colour(estimator),
            dash=dash, visible=shown, customdata=np.stack([path["t"], path["tau"]], axis=-1),
            hovertemplate=f"{charts.label(estimator)}, {what}, arc %{{customdata[1]:.0f}}<br>"
                          "t %{customdata[0]:.2f} s<br>x %{y:.2f}, y %{x:.2f} m<extra></extra>"))


def _add_final_points(figure, result, estimator, shown):
    arcs = result.arcs[(result.arcs.estimator == estimator) & (result.arcs.gamma == result.gamma)]
    arcs = arcs.dropna(subset=["x_predicted", "y_predicted"])
    if arcs.empty:
        return
    colour, name = charts.colour(estimator), charts.label(estimator)
    outlines = [ellipse_95(row, 33 if len(arcs) <= 100 else 17) for row in arcs.itertuples()]
    x = np.concatenate([[*x, np.nan] for x, _ in outlines])
    y = np.concatenate([[*y, np.nan] for _, y in outlines])
    figure.add_trace(charts.lines(charts.rounded(y), charts.rounded(x), f"{name}, 95 % ellipses",
                                  colour, width=1, visible=shown, hoverinfo="skip", opacity=0.6))
    figure.add_trace(go.Scatter(
        x=charts.rounded(arcs.y_predicted), y=charts.rounded(arcs.x_predicted),
        name=f"{name}, final points", mode="markers", visible=shown,
        marker=dict(color=colour, size=9, symbol="diamond", line=dict(color="#fff", width=1)),
        customdata=np.stack([arcs.tau, charts.rounded(arcs.final_point_error),
                             charts.rounded(arcs.predicted_sigma)], axis=-1),
        hovertemplate=f"{name}, end of arc %{{customdata[0]:.0f}}<br>"
                      "x %{y:.2f}, y %{x:.2f} m<br>error %{customdata[1]:.2f} m, "
                      "predicted sigma %{customdata[2]:.2f} m<extra></extra>"))
    truth = arcs.dropna(subset=["x_truth", "y_truth"])
    if estimator == result.estimator and not truth.empty:
        figure.add_trace(go.Scatter(
            x=charts.rounded(truth.y_truth), y=charts.rounded(truth.x_truth),
            name="True final points", mode="markers", customdata=truth.tau,
            marker=dict(color=charts.INK, size=8, symbol="x-thin", line=dict(width=2)),
            hovertemplate="True end of arc %{customdata:.0f}<br>"
                          "x %{y:.2f}, y %{x:.2f} m<extra></extra>"))


def _add_gates(figure, log):
    """Each gate as a bar across its flight direction, with its id."""
    if not log.gates:
        return
    x, y, text = [], [], []
    for gate in log.gates:
        north, east = gate["position"][0], gate["position"][1]
        yaw = gate.get("yaw", 0.0)
        across = 0.5 * GATE_WIDTH * np.array([-math.sin(yaw), math.cos(yaw)])
        x += [north - across[0], north, north + across[0], None]
        y += [east - across[1], east, east + across[1], None]
        text += ["", f"gate {html.escape(str(gate['id']))}<br> ", "", ""]
    figure.add_trace(go.Scatter(
        x=y, y=x, text=text, mode="lines+text", name="Gates (drawn 1 m wide)",
        textposition="top center", textfont=dict(size=12, color=charts.MUTED),
        line=dict(color=charts.INK, width=4), hoverinfo="text"))
