"""The page of trueline design: score, path, speeds and limits of the designed flight."""
import math

import plotly.graph_objects as go
from plotly.subplots import make_subplots

import charts
from charts import embed
from csv_table import read_table
from page import Page, escape, paragraph
from tables import number, table, tiles
from yaml_file import read_mapping

STATES = ["t", "x", "y", "z", "yaw", "qw", "qx", "qy", "qz", "wx", "wy", "wz"]
RPM = 30 / math.pi


def build(arguments):
    score = read_mapping(arguments.result / "score.yaml")
    path = arguments.result / "trajectory.csv"
    flight = read_table(path, STATES + _rotors(path))
    page = Page("Designed flight", f"to show {', '.join(score['show'])}")
    page.add("score", "Score", *_score(score))
    page.add("path", "Path", paragraph("NED earth frame, height upwards; coloured by time.", "note"),
             embed(_path(flight), "plot-path"))
    page.add("limits", "Limits", _limits(score), embed(_over_time(flight, score), "plot-time"))
    return page


def _rotors(path):
    """Names of the rotor columns: w1, w2, ..."""
    try:
        header = path.read_text(encoding="utf-8").split("\n", 1)[0]
    except OSError:
        return []
    names = [field.split()[0] for field in header.split(",") if field.split()]
    return [name for name in names if name[0] == "w" and name[1:].isdigit()]


def _score(score):
    compared = score.get("compared") or {}
    by_bound = score.get("criterion") == "bound"
    items = [(number(score["score"]), "times narrower than the prior, rms" if by_bound else
              "smallest singular value, scaled"),
             (number(score["start_score"]), "of the best figure it began as" if by_bound else
              "of the random flight it began as")]
    for kind in ("random", "lissajous"):
        if kind in compared:
            c = compared[kind]
            items.append((number(c["best"]), f"best of {c['count']} {kind} flights "
                                             f"(median {number(c['median'])})"))
    items.append((f"{score['seconds']:.0f} s", f"to design, {score['iterations']} "
                                               f"{'flights tried' if by_bound else 'iterations'}"))
    rows = [[escape(name), number(entry["value"]), number(entry["random"]), escape(entry["unit"])]
            for name, entry in score["crlb_whole_flight"].items()]
    headers = [("parameter", 0), ("sigma", 1), ("of a random flight", 1), ("unit", 0)]
    note = ("Bound of Cramer and Rao of the batch calibration, with disturbances and prior."
            if by_bound else
            "Bound of Cramer and Rao by the exact Gramian, the motion model trusted throughout.")
    return [tiles(items), table(headers, rows), paragraph(note, "note")]


def _limits(score):
    rows = [[escape(name.replace("_", " ")), number(entry["used"], 4), number(entry["limit"], 4),
             escape(entry["unit"])] for name, entry in score["limits"].items()]
    return table([("limit", 0), ("used", 1), ("allowed", 1), ("unit", 0)], rows)


def _path(flight):
    figure = go.Figure(go.Scatter3d(
        x=charts.rounded(flight.x, 5), y=charts.rounded(flight.y, 5), z=charts.rounded(-flight.z, 5),
        mode="lines", line=dict(width=4, color=charts.rounded(flight.t), colorscale="Viridis",
                                colorbar=dict(title="t [s]", thickness=14)),
        hovertemplate="x %{x:.2f}, y %{y:.2f}, height %{z:.2f} m<extra></extra>"))
    charts.style(figure, 560, margin=dict(l=0, r=0, t=8, b=8))
    figure.update_layout(scene=dict(aspectmode="data", camera=dict(eye=dict(x=2.1, y=2.1, z=1.4)),
                                    xaxis_title="x, north [m]",
                                    yaxis_title="y, east [m]", zaxis_title="height [m]"))
    return figure


def _over_time(flight, score):
    """Tilt, body rates and rotor speeds, with their limits dashed."""
    figure = make_subplots(rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.06)
    t, limits = charts.rounded(flight.t), score["limits"]
    tilt = [math.degrees(math.acos(max(-1, min(1, 1 - 2 * (x * x + y * y)))))
            for x, y in zip(flight.qx, flight.qy)]
    figure.add_trace(charts.lines(t, charts.rounded(tilt, 1), "tilt", charts.INK, width=1.2), 1, 1)
    for name, colour in zip(("wx", "wy", "wz"), ("#1f6feb", "#e07b00", "#15803d")):
        figure.add_trace(charts.lines(t, charts.rounded(flight[name]), name, colour, width=1.2), 2, 1)
    rotors = [c for c in flight.columns if c[0] == "w" and c[1:].isdigit()]
    for index, name in enumerate(rotors):
        colour = charts.SPARE_COLOURS[index % len(charts.SPARE_COLOURS)]
        figure.add_trace(charts.lines(t, charts.rounded(flight[name] * RPM, 0), f"rotor {name[1:]}",
                                      colour, width=1.2), 3, 1)
    for row, values in ((1, [math.degrees(limits[k]["limit"]) for k in ("tilt", "roll", "pitch") if k in limits]),
                        (2, [-limits["rate"]["limit"], limits["rate"]["limit"]]),
                        (3, [limits[k]["limit"] * RPM for k in ("min_speed", "max_speed")])):
        for value in values:
            figure.add_hline(y=value, row=row, col=1, line=dict(color=charts.BAD, dash="dash", width=1))
    charts.style(figure, 720, margin=dict(l=64, r=16, t=48, b=48))
    for row, title in ((1, "tilt [deg]"), (2, "body rate [rad/s]"), (3, "rotor [rpm]")):
        figure.update_yaxes(title_text=title, row=row, col=1)
    figure.update_xaxes(title_text="t [s]", row=3, col=1)
    return figure
