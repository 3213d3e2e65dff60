"""A result as one picture, from above. A diagnosis before and after: a line from where the vehicle
was to where the model has it two seconds after it last saw a gate. A calibration: the arcs that were
predicted blind, and where the vehicle really was."""
import math
import textwrap

import numpy as np

from calibration_result import read_calibration
from charts import BAD, INK, MUTED, TRUTH, decimate
from csv_table import read_table
from errors import ReportError
from page import Document, escape
from plots_track import ellipse_95
from tables import number, with_sigma
from yaml_file import read_mapping

GOOD = "#1a7f4b"
PANEL, MARGIN, HEAD, LINE, FOOT = 430, 24, 62, 18, 40  # px
LETTERS = 54   # of a line below a panel's title
HORIZON = 2.0  # s
LINES = 120    # of a panel
POINTS = 60    # of an arc


def build(arguments):
    if (arguments.result / "calibration.yaml").exists():
        return Forecasts(read_calibration(arguments.result))
    result = read_mapping(arguments.result / "diagnosis.yaml")
    columns = ["horizon", "x", "y"] + [f"{axis}_{when}" for axis in ("north", "east")
                                       for when in ("before", "after")]
    rows = read_table(arguments.result / "misfit.csv", columns)
    rows = rows[(rows.horizon - HORIZON).abs() < 1e-6]
    if rows.empty or not result.get("causes"):
        raise ReportError(f"{arguments.result}: the diagnosis names no cause, or no replay lasts "
                          f"{HORIZON:g} s; there is no before and after to draw")
    return BeforeAndAfter(result, decimate(rows, LINES))


class Picture(Document):
    """Places (NED) drawn on panels of one scale, north up, below lines of words."""

    def __init__(self, north, east, panel_width, words, foot):
        self.low = [np.min(north) - 1.0, np.min(east) - 1.0]  # m
        wide, high = np.ptp(east) + 2.0, np.ptp(north) + 2.0
        self.scale = min((panel_width - 2 * MARGIN) / wide, (PANEL - 2 * MARGIN) / high)  # px / m
        self.aside = (panel_width - self.scale * wide) / 2  # px, left of the course
        self.height = math.ceil(self.scale * high) + 2 * MARGIN
        self.words, self.head, self.foot = words, HEAD + LINE * len(words), foot

    def render(self):
        width, height = 2 * PANEL, self.head + self.height + FOOT
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
                f'font-family="system-ui, Helvetica, Arial, sans-serif" font-size="16">'
                f'<rect width="{width}" height="{height}" fill="#fff"/>{"".join(self.panels())}'
                f'<text x="{MARGIN}" y="{height - 14}" fill="{MUTED}" font-size="14">From above. '
                f'{escape(self.foot)}</text></svg>\n')

    def title(self, left, text, result, colour, words=()):
        lines = [f'<text x="{left}" y="{72 + LINE * i}" fill="{MUTED}" font-size="14">{escape(line)}</text>'
                 for i, line in enumerate(words)]
        return (f'<text x="{left}" y="26" font-weight="600">{escape(text)}</text>'
                f'<text x="{left}" y="50" fill="{colour}">{escape(result)}</text>{"".join(lines)}')

    def line(self, north, east, panel=0):
        """The path of an SVG through these places; `panel` begins at this x."""
        x = panel + self.aside + self.scale * (np.asarray(east) - self.low[1])
        y = self.head + self.height - MARGIN - self.scale * (np.asarray(north) - self.low[0])
        return "M" + "L".join(f"{u:.0f} {v:.0f}" for u, v in zip(x, y))


def stroke(paths, colour, width, more=""):
    return f'<path d="{"".join(paths)}" fill="none" stroke="{colour}" stroke-width="{width}" {more}/>'


def dots(paths, colour):
    return stroke([f"{path}h0" for path in paths], colour, 5, 'stroke-linecap="round"')


class BeforeAndAfter(Picture):
    def __init__(self, result, rows):
        causes = "; ".join(cause["id"].replace("_", " ") + " " + ", ".join(
            f'{name} {with_sigma(p["value"], p["sigma"])} {p["unit"]}'
            for name, p in cause["parameters"].items() if "sigma" in p) for cause in result["causes"])
        super().__init__(rows.x, rows.y, PANEL, textwrap.wrap(causes, LETTERS),
                         f"Dot: where the vehicle was. Line: to where the model has it {HORIZON:g} s after "
                         "the last known position.")
        self.rows = rows

    def panels(self):
        yield self._panel(0, "before", BAD, "Before: the model as calibrated")
        yield self._panel(PANEL, "after", GOOD, "After: with what was found", self.words)

    def _panel(self, at, when, colour, title, words=()):
        rows = self.rows
        north, east = rows[f"north_{when}"], rows[f"east_{when}"]
        rms = math.sqrt(np.mean(north**2 + east**2))
        return (self.title(at + MARGIN, title, f"{number(rms, 2)} m off after {HORIZON:g} s (rms)", colour, words)
                + stroke([self.line((x, x + n), (y, y + e), at)
                          for x, y, n, e in zip(rows.x, rows.y, north, east)], colour, 2)
                + dots([self.line([x], [y], at) for x, y in zip(rows.x, rows.y)], MUTED))


class Forecasts(Picture):
    def __init__(self, result):
        self.arcs = result.headline_rows(result.arcs).dropna(subset=["x_predicted", "final_point_error"])
        paths = result.trajectory[result.trajectory.estimator == result.estimator]
        if self.arcs.empty or paths.empty:
            raise ReportError("the calibration predicts no arc whose end is known; there is nothing to draw")
        self.paths = [(kind, decimate(piece, POINTS)) for (kind, _), piece in paths.groupby(["kind", "tau"])]
        known = [f'{name} {with_sigma(p["value"], p["sigma"])} {p["unit"]}'
                 for name, p in result.summary["parameters"].items()
                 if p["status"] == "identified" and p["unit"] != "rad"]
        super().__init__(paths.x, paths.y, 2 * PANEL, textwrap.wrap("; ".join(known), 2 * LETTERS),
                         "Green: predicted blind, to its 95 % ellipse. Dot: where the vehicle was.")

    def panels(self):
        of = {kind: [self.line(piece.x, piece.y) for k, piece in self.paths if k == kind]
              for kind in ("fit", "prediction")}
        yield self.title(MARGIN, f"{len(self.arcs)} arcs, predicted from the passes before them",
                         f"{number(self.arcs.final_point_error.mean(), 2)} m off at the end (mean)", GOOD, self.words)
        yield stroke(of["fit"], TRUTH, 1)
        yield stroke(of["prediction"], GOOD, 2)
        yield stroke([self.line(*ellipse_95(row)) for row in self.arcs.itertuples()], GOOD, 1)
        known = self.arcs.dropna(subset=["x_truth", "y_truth"])
        yield dots([self.line([x], [y]) for x, y in zip(known.x_truth, known.y_truth)], INK)
