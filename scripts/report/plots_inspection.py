"""What an inspection saw: streams over each other at the best lag, their time lines, spectra."""
import re

import numpy as np
import pandas as pd
import plotly.graph_objects as go
from plotly.subplots import make_subplots

import charts
from csv_table import read_table
from tables import number, with_sigma

GYRO, ACCEL, QUATERNION, POSITION = ["gx", "gy", "gz"], ["ax", "ay", "az"], ["qw", "qx", "qy", "qz"], ["x", "y", "z"]
COLUMNS = {"imu": ACCEL + GYRO, "attitude": QUATERNION, "mocap": POSITION + QUATERNION,
           "pose": POSITION + QUATERNION, "fixes": POSITION, "rotors": [], "motors": [], "battery": [], "range": []}
REFERENCE, STREAM = "#8a94a3", "#1f6feb"
LEVELS = {"fatal": "#c0312b", "biases": "#c0312b", "widens": "#a86500", "note": "#1a7f4b"}
SHOWN = 20.0       # s of flight laid over each other, from the middle
SMOOTH = 0.1       # s, at least, over which second differences of positions are averaged
GAP = 3.0          # times the median interval
MOST = 1500        # points of a line
TIMES = re.compile(r"(?:from|at|between) ([\d.]+)(?: s)?(?: (?:to|and) ([\d.]+))? s")


def read_streams(log):
    """{name: data frame with t in s since the first IMU sample} of the streams that the log has."""
    streams = {}
    for name, columns in COLUMNS.items():
        if (log / f"{name}.csv").exists():
            frame = read_table(log / f"{name}.csv", ["t", *columns], may_be_cut_off=True)
            if len(frame) > 2:
                streams[name] = frame
    start = streams["imu"].t.iloc[0] if "imu" in streams else 0.0
    for frame in streams.values():
        frame.t -= start
    return streams


def _lengths(t, values):
    return pd.DataFrame({"t": t, "v": np.linalg.norm(values, axis=1)})


def _turn_rate(frame):
    """Length of the turn rate, rad/s, by neighbouring quaternions: any mounting has the same."""
    q = frame[QUATERNION].to_numpy()
    q = q / np.linalg.norm(q, axis=1, keepdims=True)
    angle = 2.0 * np.arccos(np.clip(np.abs(np.sum(q[1:] * q[:-1], axis=1)), 0.0, 1.0))
    t = frame.t.to_numpy()
    return pd.DataFrame({"t": 0.5 * (t[1:] + t[:-1]), "v": angle / np.diff(t)})


def _specific_force(frame, step):
    """Length of the second derivative of positions less gravity, m/s^2, by differences over `step` s."""
    t, p = frame.t.to_numpy(), frame[POSITION].to_numpy()
    grid = np.arange(t[0], t[-1], step)
    p = np.stack([np.interp(grid, t, axis) for axis in p.T], axis=1)
    force = (p[2:] - 2.0 * p[1:-1] + p[:-2]) / step**2 - [0.0, 0.0, 9.81]
    return _lengths(grid[1:-1], force)


def _smoothed(line, seconds):
    step = max(line.t.diff().median(), 1e-6)
    return line.assign(v=line.v.rolling(max(1, round(seconds / step)), center=True, min_periods=1).mean())


def _averaged(imu, names, seconds):
    """Lengths of vectors as differences over `seconds` see them: averaged twice. The body's turns are neglected."""
    rows = max(1, round(seconds / max(imu.t.diff().median(), 1e-6)))
    once = imu[names].rolling(rows, center=True, min_periods=1).mean()
    return _lengths(imu.t, once.rolling(rows, center=True, min_periods=1).mean())


def _pair(comparison, streams):
    """(title, reference, stream) as lines over time, or None where a stream is not at hand."""
    name, what = comparison["stream"], comparison["what"]
    if name not in streams or "imu" not in streams:
        return None
    imu, frame = streams["imu"], streams[name]
    if what.startswith("turn rates") and set(QUATERNION) <= set(frame):
        step = max(0.02, frame.t.diff().median())
        return "turn rate [rad/s]", "gyroscope", _averaged(imu, GYRO, step), _smoothed(_turn_rate(frame), step)
    if what.startswith("positions against the accelerometer"):
        step = max(SMOOTH, 2.0 * frame.t.diff().median())  # between samples a line would show no force
        return ("specific force [m/s²]", "accelerometer", _averaged(imu, ACCEL, step), _specific_force(frame, step))
    if what == "positions against mocap" and "mocap" in streams:
        mocap = streams["mocap"]
        return ("north [m]", "mocap", mocap[["t", "x"]].set_axis(["t", "v"], axis=1),
                frame[["t", "x"]].set_axis(["t", "v"], axis=1))
    return None


def overlays(comparisons, streams):
    """A figure of each comparison that the flight shows: both streams at the best lag."""
    pairs = [(c, pair) for c in comparisons if c.get("shown") and (pair := _pair(c, streams))]
    if not pairs:
        return None
    middle = 0.5 * (streams["imu"].t.iloc[0] + streams["imu"].t.iloc[-1])
    titles = [f'{c["stream"]} on {pair[1]}, {with_sigma(1e3 * c["late_by"]["value"], 1e3 * c["late_by"]["sigma"])} ms late'
              for c, pair in pairs]
    figure = make_subplots(rows=len(pairs), cols=1, vertical_spacing=0.34 / (len(pairs) + 1), subplot_titles=titles)
    for row, (c, (axis, _, reference, stream)) in enumerate(pairs, 1):
        moved = stream.assign(t=stream.t - c["late_by"]["value"])
        for line, colour, name in ((reference, REFERENCE, "reference"), (moved, STREAM, "stream")):
            part = charts.decimate(line[(line.t - middle).abs() < SHOWN / 2], MOST)
            sparse = name == "stream" and c["stream"] == "fixes"
            figure.add_scatter(x=charts.rounded(part.t), y=charts.rounded(part.v, 4), name=name, showlegend=False,
                               mode="markers" if sparse else "lines", row=row, col=1,
                               line=dict(color=colour, width=2 if name == "reference" else 1.2),
                               marker=dict(color=colour, size=5))
        figure.update_yaxes(title_text=axis, row=row, col=1)
    charts.style(figure, 90 + 210 * len(pairs))
    figure.update_annotations(font=dict(size=13))
    figure.update_xaxes(title_text="since the first IMU sample [s]", row=len(pairs))
    return figure


def time_line(streams, findings):
    """A bar for each stream where it has samples, gaps left out; findings where they are."""
    figure = go.Figure()
    for name, frame in streams.items():
        t = frame.t.to_numpy()
        longest = max(GAP * np.median(np.diff(t)), 0.05)
        pieces = charts.split_at_gaps(frame, longest)
        ends = [(piece.t.iloc[0], piece.t.iloc[-1]) for piece in pieces]
        x = np.array([[a, b, np.nan] for a, b in ends]).ravel()
        figure.add_scatter(x=charts.rounded(x), y=[name] * len(x), mode="lines", name=name, showlegend=False,
                           connectgaps=False, line=dict(color=STREAM, width=14),
                           hovertext=f"{name}: {len(t)} samples, {len(pieces) - 1} gaps", hoverinfo="text+x")
        for a, b in zip(ends, ends[1:]):
            if name != "fixes":
                figure.add_vrect(x0=a[1], x1=b[0], fillcolor="#c0312b", opacity=0.15, line_width=0)
    last = max((frame.t.iloc[-1] for frame in streams.values()), default=0.0)
    for finding in findings:
        times = TIMES.search(finding["text"])
        where = [float(end) for end in times.groups() if end] if times else [0.0, last]
        row = finding["stream"] if finding["stream"] in streams else list(streams)[0]
        figure.add_scatter(x=charts.rounded(where), y=[row] * len(where), mode="lines+markers", showlegend=False,
                           line=dict(color=LEVELS[finding["level"]], width=3),
                           marker=dict(size=10, symbol="diamond", color=LEVELS[finding["level"]]),
                           hovertext=f'{finding["id"]}: {finding["text"]}'.replace("<", "&lt;"), hoverinfo="text")
    charts.style(figure, 110 + 34 * len(streams), hovermode="closest")
    figure.update_xaxes(title_text="since the first IMU sample [s]")
    figure.update_yaxes(automargin=True, range=[len(streams) - 0.4, -0.6])
    return figure


def amplitude_density(values, rate):
    """(frequencies above zero in Hz, unit/sqrt(Hz)): Welch's mean over half-overlapping Hann windows."""
    size = min(1024, len(values))
    window = np.hanning(size)
    starts = range(0, len(values) - size + 1, max(1, size // 2))
    parts = np.stack([values[i:i + size] - values[i:i + size].mean() for i in starts])
    power = np.mean(np.abs(np.fft.rfft(parts * window)) ** 2, axis=0) * 2.0 / (rate * np.sum(window**2))
    return np.fft.rfftfreq(size, 1.0 / rate)[1:], np.sqrt(power[1:])


def spectra(streams, axes):
    """Amplitude density of the IMU's axes, with the strongest line and a filter's cut-off."""
    imu = streams["imu"]
    rate = 1.0 / max(imu.t.diff().median(), 1e-6)
    figure = make_subplots(rows=2, cols=1, vertical_spacing=0.16)
    lines = {axis["axis"]: axis.get("line_Hz") for axis in axes}
    for row, (names, what) in enumerate(((ACCEL, "m/s²/√Hz"), (GYRO, "rad/s/√Hz")), 1):
        highest = lowest = None
        for name, colour in zip(names, ("#1f6feb", "#e07b00", "#15803d")):
            values = imu[name].dropna().to_numpy()
            f, density = amplitude_density(values, rate)
            highest = max(density.max(), highest or 0.0)
            lowest = min(density[density > 0].min(initial=highest), lowest or highest)
            figure.add_trace(charts.lines(charts.rounded(f, 2), charts.rounded(density, 7), name, colour, width=1.3),
                             row, 1)
        if line := max((lines.get(name) or 0.0 for name in names), default=0.0):
            figure.add_trace(charts.lines([line, line], [lowest, highest], f"{number(line)} Hz", REFERENCE, "dot"),
                             row, 1)
        figure.update_yaxes(title_text=what, row=row, col=1)
    charts.style(figure, 520, legend=charts.legend_at(1.02))
    figure.update_xaxes(type="log")
    figure.update_xaxes(title_text="frequency [Hz]", row=2)
    figure.update_yaxes(type="log")
    return figure
