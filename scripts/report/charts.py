"""What all charts share: colours, layout, decimation, embedding."""
import html

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

COLOURS = {"vgd": "#1f6feb", "vgd_kinematic": "#e07b00", "ekf": "#b0389a", "smoother": "#15803d"}
SPARE_COLOURS = ["#0e7490", "#7c4a03", "#64748b", "#be123c"]
NAMES = {"vgd": "VGD", "vgd_kinematic": "VGD, kinematic", "ekf": "EKF", "smoother": "Smoother"}
INK, MUTED, GRID = "#1b2430", "#627084", "#e9edf2"
FIXES, TRUTH, BAD = "#f59e0b", "#8a94a3", "#c0312b"
FONT = 'system-ui, "Segoe UI", Roboto, "DejaVu Sans", Arial, sans-serif'
CONFIG = ('{"responsive": true, "displaylogo": false, '
          '"modeBarButtonsToRemove": ["lasso2d", "select2d"]}')


def colour(estimator):
    if estimator in COLOURS:
        return COLOURS[estimator]
    return SPARE_COLOURS[sum(map(ord, estimator)) % len(SPARE_COLOURS)]


def label(estimator):
    """Text from data for use in a chart, where plotly reads it as HTML."""
    return NAMES.get(estimator, html.escape(estimator))


def unit_label(name, unit):
    """An axis title; angles and other units as the file states them."""
    return f"{html.escape(name)} [{html.escape(unit)}]" if unit else html.escape(name)


def legend_at(y):
    """A row of entries whose lower edge is at y, in heights of the plot."""
    return dict(orientation="h", x=0, y=y, xanchor="left", yanchor="bottom")


def style(figure, height, **layout):
    """The look of every chart."""
    figure.update_layout(
        template="none", height=height, font=dict(family=FONT, size=13, color=INK),
        margin=dict(l=64, r=16, t=36, b=48), hovermode="closest", paper_bgcolor="#fff",
        plot_bgcolor="#fff", hoverlabel=dict(font=dict(family=FONT, size=12)),
        legend=legend_at(1.0))
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor="#c6cfda", showline=True,
                        title_standoff=8, title_font=dict(size=13))
    figure.update_yaxes(gridcolor=GRID, zeroline=False, linecolor="#c6cfda", showline=True,
                        title_standoff=8, title_font=dict(size=13))
    figure.update_xaxes(exponentformat="power")
    figure.update_yaxes(exponentformat="power")  # not 600µ kg m^2
    figure.update_layout(**layout)
    return figure


def small_multiples(titles, above, y):
    """Three panels a row: the figure, and row and column of each. `above`: px; `y`: of the legend, by rows."""
    rows = -(-len(titles) // 3)
    figure = make_subplots(rows=rows, cols=3, vertical_spacing=0.30 / rows, horizontal_spacing=0.07,
                           subplot_titles=titles)
    style(figure, above + 210 * rows, legend=legend_at(1 + y / rows), margin=dict(l=64, r=16, t=64, b=48))
    figure.update_annotations(font=dict(size=13, color=INK))
    return figure, [dict(row=i // 3 + 1, col=i % 3 + 1) for i in range(len(titles))], rows


def embed(figure, identifier):
    """A <div> and the script that draws the chart in it. `<` is written as \\u003c, so that no
    text in the data can end the script."""
    data = figure.to_json().replace("<", "\\u003c").replace("\u2028", "\\u2028")
    return (f'<div class="plot" id="{identifier}" style="height:{figure.layout.height}px"></div>'
            f'<script>draw("{identifier}",{data},{CONFIG});</script>')


def decimate(frame, limit):
    """At most about `limit` rows, evenly spaced, the last one always among them."""
    if len(frame) <= limit:
        return frame
    rows = np.unique(np.linspace(0, len(frame) - 1, max(2, limit)).round().astype(int))
    return frame.iloc[rows]


def rounded(values, decimals=3):
    """Values as short numbers: a millimetre or millisecond is enough for a picture."""
    return np.round(np.asarray(values, dtype=float), decimals)


def in_pieces(pieces, columns):
    """Arrays of `columns` over all pieces, with NaN between pieces so that no line joins them."""
    joined = {column: [] for column in columns}
    for piece in pieces:
        for column in columns:
            joined[column] += [*rounded(piece[column]), np.nan]
    return {column: np.array(values[:-1]) for column, values in joined.items()}


def split_at_gaps(frame, longest):
    """Pieces of a stream between gaps longer than `longest` seconds."""
    cuts = np.flatnonzero(np.diff(frame.t.to_numpy()) > longest) + 1
    return [piece for piece in np.split(frame, cuts) if len(piece)]


def band(x, low, high, colour_, opacity, **more):
    """The area between two curves."""
    return go.Scatter(x=[*x, *x[::-1]], y=[*high, *low[::-1]], fill="toself", mode="none",
                      fillcolor=rgba(colour_, opacity), hoverinfo="skip", **more)


def rgba(colour_, opacity):
    return "rgba(%d,%d,%d,%g)" % (*(int(colour_[i:i + 2], 16) for i in (1, 3, 5)), opacity)


def mean_and_median(groups, shift, colour_, before, unit):
    """Of values by gamma: lines join the means, diamonds are medians. `before`: of the entries' names."""
    mean, median = groups.mean(), groups.median()
    return [go.Scatter(x=mean.index + shift, y=rounded(mean), mode="lines+markers", line=dict(color=colour_, width=2),
                       marker=dict(size=8), name=f"{before}mean",
                       hovertemplate=f"{before}mean{':' if before else ''} %{{y:.3~f}} {unit}<extra></extra>"),
            go.Scatter(x=median.index + shift, y=rounded(median), mode="markers", name=f"{before}median",
                       marker=dict(color="#fff", size=9, symbol="diamond", line=dict(color=colour_, width=2)),
                       hovertemplate=f"{before}median{':' if before else ''} %{{y:.3~f}} {unit}<extra></extra>")]


def lines(x, y, name, colour_, dash="solid", width=2, **more):
    return go.Scatter(x=x, y=y, name=name, mode="lines",
                      line=dict(color=colour_, dash=dash, width=width), **more)
