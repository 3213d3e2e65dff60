"""A diagnosis as one picture, before and after: the course from above, with a line from where the
vehicle was to where the model has it two seconds after it last saw a gate."""
import math
import textwrap

import numpy as np

from charts import BAD, MUTED, decimate
from csv_table import read_table
from errors import ReportError
from page import Document, escape
from tables import number, with_sigma
from yaml_file import read_mapping

VERB_HELP = "the result of trueline-diagnose, as an SVG picture"
PROGRAM = "trueline-diagnose"
GOOD = "#1a7f4b"
PANEL, MARGIN, HEAD, LINE, FOOT = 430, 24, 62, 18, 40  # px
LETTERS = 54   # of a line below a title
HORIZON = 2.0  # s
LINES = 120    # of a panel


def build(arguments):
    result = read_mapping(arguments.result / "diagnosis.yaml", "run trueline-diagnose first")
    columns = ["horizon", "x", "y"] + [f"{axis}_{when}" for axis in ("north", "east")
                                       for when in ("before", "after")]
    rows = read_table(arguments.result / "misfit.csv", columns)
    rows = rows[(rows.horizon - HORIZON).abs() < 1e-6]
    if rows.empty or not result.get("causes"):
        raise ReportError(f"{arguments.result}: the diagnosis names no cause, or no replay lasts "
                          f"{HORIZON:g} s; there is no before and after to draw")
    return Picture(result, decimate(rows, LINES))


class Picture(Document):
    def __init__(self, result, rows):
        self.result, self.rows = result, rows
        reach = np.concatenate([rows[c] for c in ("x", "y")])
        self.low = [rows.x.min() - 1.0, rows.y.min() - 1.0]  # m, north and east
        self.scale = (PANEL - 2 * MARGIN) / max(np.ptp(rows.x) + 2.0, np.ptp(rows.y) + 2.0,
                                                1e-3 * np.abs(reach).max())

        self.words = textwrap.wrap(self._causes(), LETTERS)
        self.head = HEAD + LINE * len(self.words)

    def render(self):
        width, height = 2 * PANEL, self.head + PANEL + FOOT
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
                f'font-family="system-ui, Helvetica, Arial, sans-serif" font-size="16">'
                f'<rect width="{width}" height="{height}" fill="#fff"/>'
                f'{self._panel(0, "before", BAD, "Before: the model as calibrated")}'
                f'{self._panel(1, "after", GOOD, "After: with what was found", self.words)}'
                f'<text x="{MARGIN}" y="{height - 14}" fill="{MUTED}" font-size="14">From above. '
                f'Dot: where the vehicle was. Line: to where the model has it {HORIZON:g} s after '
                f'the last known position.</text></svg>\n')

    def _causes(self):
        return "; ".join(cause["id"].replace("_", " ") + " " + ", ".join(
            f'{name} {with_sigma(p["value"], p["sigma"])} {p["unit"]}'
            for name, p in cause["parameters"].items() if "sigma" in p) for cause in self.result["causes"])

    def _panel(self, column, when, colour, title, more=()):
        north, east = self.rows[f"north_{when}"], self.rows[f"east_{when}"]
        rms = math.sqrt(np.mean(north**2 + east**2))
        lines, dots = [], []
        for x, y, n, e in zip(self.rows.x, self.rows.y, north, east):
            (u, v), (du, dv) = self._at(x, y, column), self._at(x + n, y + e, column)
            lines.append(f"M{u:.0f} {v:.0f}L{du:.0f} {dv:.0f}")
            dots.append(f"M{u:.0f} {v:.0f}h0")
        left = column * PANEL + MARGIN
        words = [f'<text x="{left}" y="{72 + LINE * i}" fill="{MUTED}" font-size="14">{escape(text)}</text>'
                 for i, text in enumerate(more)]
        return (f'<text x="{left}" y="26" font-weight="600">{escape(title)}</text>'
                f'<text x="{left}" y="50" fill="{colour}">{number(rms, 2)} m off after {HORIZON:g} s '
                f'(rms)</text>{"".join(words)}<path d="{"".join(lines)}" stroke="{colour}" stroke-width="2"/>'
                f'<path d="{"".join(dots)}" stroke="{MUTED}" stroke-width="5" '
                'stroke-linecap="round"/>')

    def _at(self, north, east, column):
        """Pixels of a place in NED; north is up."""
        return (column * PANEL + MARGIN + self.scale * (east - self.low[1]),
                self.head + PANEL - MARGIN - self.scale * (north - self.low[0]))
