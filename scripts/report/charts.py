"""What all charts share: colours, layout, decimation, embedding."""
import html

import numpy as np
import plotly.graph_objects as go

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


def style(figure, height, **layout):
    """The look of every chart."""
    figure.update_layout(
        template="none", height=height, font=dict(family=FONT, size=13, color=INK),
        margin=dict(l=64, r=16, t=36, b=48), hovermode="closest", paper_bgcolor="#fff",
        plot_bgcolor="#fff", hoverlabel=dict(font=dict(family=FONT, size=12)),
        legend=dict(orientation="h", x=0, y=1.0, xanchor="left", yanchor="bottom"))
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor="#c6cfda", showline=True,
                        title_standoff=8, title_font=dict(size=13))
    figure.update_yaxes(gridcolor=GRID, zeroline=False, linecolor="#c6cfda", showline=True,
                        title_standoff=8, title_font=dict(size=13))
    figure.update_xaxes(exponentformat="power")
    figure.update_yaxes(exponentformat="power")  # not 600µ kg m^2
    figure.update_layout(**layout)
    return figure


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


def lines(x, y, name, colour_, dash="solid", width=2, **more):
    return go.Scatter(x=x, y=y, name=name, mode="lines",
                      line=dict(color=colour_, dash=dash, width=width), **more)
