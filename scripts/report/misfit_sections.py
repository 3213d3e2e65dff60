"""Misfit: growth of the open-loop error, and the variables correlated with it."""
import numpy as np
from plotly.subplots import make_subplots

from charts import BAD, FIXES, MUTED, decimate, embed, rounded, style
from csv_table import read_table
from page import details, paragraph
from tables import number, percent, table

FRAMES = {"rms_earth_m": ("Earth axes", ["north", "east", "down"]),
          "rms_body_m": ("Body axes", ["forward", "right", "down"])}
WHEN = {"before": BAD, "after": FIXES}
QUANTITIES = {"speed": "speed [m/s]", "acceleration": "acceleration [m/s²]",
              "thrust": "thrust [m/s²]", "rate": "turn rate [rad/s]", "heading": "heading [rad]",
              "gate_distance": "distance to the gate [m]", "height": "height [m]",
              "time": "time [s]", "battery": "battery [V]"}
LEAST_REPLAYS = 9  # with a known value of a quantity, to draw the error against it
ERRORS = [f"{axis}_{when}" for when in WHEN for axis in ("north", "east", "forward", "right")]


def sections(result, folder):
    """Blocks of the page; empty where the result has no misfit."""
    misfit = result.get("misfit")
    if not misfit or not misfit.get("growth"):
        return []
    rows = read_table(folder / "misfit.csv", ["horizon", "gate", "x", "y", *QUANTITIES, *ERRORS])
    chosen = rows[np.isclose(rows.horizon, misfit["shares_horizon_s"], rtol=0.01)]
    seconds = number(misfit["shares_horizon_s"], 2)
    note = (f"The flight is replayed with the calibrated model from each fitted state, without "
            f"correction, and compared with the {misfit['measured_by']}. Before: the model without "
            f"the causes; after: with them.")
    blocks = [paragraph(note, "note")]
    if len(chosen):
        blocks += [f"<h3>Where the error after {seconds} s arises</h3>",
                   embed(_places(chosen), "plot-places")]
    blocks += ["<h3>How fast it grows</h3>", embed(_growth(misfit), "plot-growth"),
               details("As a table", _growth_table(misfit))]
    known = [column for column in QUANTITIES if chosen[column].notna().sum() >= LEAST_REPLAYS]
    if known and misfit.get("share_of_variance"):
        blocks += [f"<h3>Variables correlated with the error after {seconds} s</h3>",
                   embed(_quantities(chosen, known), "plot-quantities"),
                   details("Shares of its variance", _share_table(misfit))]
    return blocks


def _growth_table(misfit):
    headers = [("horizon [s]", 1), ("replays", 1), ("horizontal before [m]", 1), ("after [m]", 1),
               ("vertical before [m]", 1), ("after [m]", 1)]
    rows = []
    for g in misfit["growth"]:
        earth = g["rms_earth_m"]
        flat = [float(np.hypot(earth["north"][i], earth["east"][i])) for i in (0, 1)]
        rows.append([number(g["horizon_s"]), str(g["replays"]),
                     *[number(v) for v in flat], *[number(v) for v in earth["down"]]])
    return table(headers, rows)


def _growth(misfit):
    figure = make_subplots(rows=1, cols=2, shared_yaxes=True, horizontal_spacing=0.04,
                           subplot_titles=[title for title, _ in FRAMES.values()])
    horizons = [g["horizon_s"] for g in misfit["growth"]]
    for column, (key, (_, axes)) in enumerate(FRAMES.items(), start=1):
        for axis, dash in zip(axes, ("solid", "dash", "dot")):
            for i, (when, colour) in enumerate(WHEN.items()):
                figure.add_scatter(x=horizons, y=[g[key][axis][i] for g in misfit["growth"]],
                                   name=f"{axis}, {when}", mode="lines+markers",
                                   line=dict(color=colour, dash=dash), row=1, col=column)
    style(figure, 380, legend=dict(orientation="v", x=1.01, y=1.0, xanchor="left", yanchor="top"))
    figure.update_xaxes(title_text="horizon [s]", rangemode="tozero")
    figure.update_yaxes(title_text="RMS error [m]", rangemode="tozero", row=1, col=1)
    return figure


def _share_table(misfit):
    headers = [("quantity", 0), ("share of variance, body axes", 1), ("earth axes", 1),
               ("chance of as much", 1)]
    rows = [[s["by"], percent(s["body"]), percent(s["earth"]), number(s["p_value"], 2)]
            for s in misfit["share_of_variance"]]
    note = ("Of the horizontal error before, over replays that do not overlap: analysis of variance "
            "over bins of the quantity, less what chance explains. Errors turned with the body "
            "point at the vehicle; errors fixed to the earth point at map, wind or heading.")
    return paragraph(note, "note") + table(headers, rows)


def _quantities(rows, known):
    """Medians and quartiles of the error along body axes over bins of each quantity."""
    figure = make_subplots(rows=2, cols=-(-len(known) // 2), vertical_spacing=0.2,
                           horizontal_spacing=0.05)
    across = -(-len(known) // 2)
    for i, column in enumerate(known):
        place = dict(row=i // across + 1, col=i % across + 1)
        for axis, symbol in (("forward", "circle"), ("right", "diamond")):
            for when, colour in WHEN.items():
                centre, median, low, high = _binned(rows[column], rows[f"{axis}_{when}"])
                figure.add_scatter(
                    x=centre, y=median, mode="lines+markers", name=f"{axis}, {when}",
                    legendgroup=f"{axis}{when}", showlegend=i == 0,
                    line=dict(color=colour, dash="solid" if axis == "forward" else "dot"),
                    marker=dict(symbol=symbol, size=6),
                    error_y=dict(type="data", symmetric=False, array=rounded(high - median),
                                 arrayminus=rounded(median - low), thickness=1, width=2), **place)
        figure.update_xaxes(title_text=QUANTITIES[column], **place)
    style(figure, 560)
    figure.update_yaxes(title_text="error [m]", col=1)
    return figure


def _binned(x, y, bins=6):
    """Bin centres, medians and quartiles of y over bins of x that hold equal numbers."""
    known = x.notna() & y.notna()
    x, y = x[known].to_numpy(), y[known].to_numpy()
    groups = [g for g in np.array_split(np.argsort(x, kind="stable"), bins) if len(g)]
    quartiles = np.array([np.percentile(y[g], [50, 25, 75]) for g in groups]).reshape(-1, 3)
    return rounded([x[g].mean() for g in groups]), *rounded(quartiles, 4).T


def _places(rows):
    """The course from above, errors as needles where they arise."""
    figure = make_subplots(rows=1, cols=2, subplot_titles=["Before", "After"], shared_yaxes=True,
                           horizontal_spacing=0.04)
    shown = decimate(rows, 400)
    extent = max(np.ptp(shown.x), np.ptp(shown.y), 1e-3)
    largest = max(np.percentile(np.hypot(shown.north_before, shown.east_before), 90), 1e-6)
    scale = 0.12 * extent / largest
    for column, (when, colour) in enumerate(WHEN.items(), start=1):
        north, east = shown[f"north_{when}"], shown[f"east_{when}"]
        gap = np.full(len(shown), np.nan)
        x = np.stack([shown.y, shown.y + scale * east, gap], axis=1).ravel()
        y = np.stack([shown.x, shown.x + scale * north, gap], axis=1).ravel()
        figure.add_scatter(x=rounded(x), y=rounded(y), mode="lines", hoverinfo="skip",
                           line=dict(color=colour, width=1.5), showlegend=False, row=1, col=column)
        figure.add_scatter(x=rounded(shown.y), y=rounded(shown.x), mode="markers", showlegend=False,
                           marker=dict(color=MUTED, size=4), row=1, col=column,
                           customdata=np.stack([rounded(np.hypot(north, east)), shown.gate], axis=1),
                           hovertemplate="%{customdata[0]:.3f} m, gate %{customdata[1]:.0f}"
                                         "<extra></extra>")
    style(figure, 480)
    figure.update_xaxes(title_text=f"east [m]; needles {number(scale, 2)} times the error")
    figure.update_yaxes(title_text="north [m]", row=1, col=1)
    figure.update_yaxes(scaleanchor="x", scaleratio=1)
    figure.update_yaxes(scaleanchor="x2", row=1, col=2)
    return figure
