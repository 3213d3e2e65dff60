"""Pages that scripts/report makes, opened in a real browser.

Set TRUELINE_SCREENSHOT=FILE.png to keep a picture of the last page that was opened whole.
"""
import contextlib
import io
import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path
from types import SimpleNamespace

from browser import Browser

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
sys.path.insert(0, str(SOURCE / "scripts/report"))

import report


def render(verb, result, out, *more):
    """As the program, whose start takes longer than a page: exit code and what it says of errors."""
    with contextlib.redirect_stderr(io.StringIO()) as said:
        code = report.main([verb, f"--result={result}", f"--out={out}", *more])
    return SimpleNamespace(returncode=code, stderr=said.getvalue())


class InFolder(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp(prefix="trueline_report_"))
        self.addCleanup(shutil.rmtree, self.root)


class PageCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = Path(tempfile.mkdtemp(prefix="trueline_report_"))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        cls.browser = cls.enterClassContext(Browser())

    @classmethod
    def open_whole(cls, page, plots):
        """Opens a page, waits for its plots; returns their names, and the console's errors."""
        cls.browser.open(page.as_uri())
        cls.browser.wait_for(
            f"return document.querySelectorAll('.js-plotly-plot .main-svg').length >= {len(plots)}")
        errors = [m for m in cls.browser.console() if m["level"] == "SEVERE"]
        if picture := os.environ.get("TRUELINE_SCREENSHOT"):
            cls.browser.resize(1366, cls.browser.run("return document.documentElement.scrollHeight") + 140)
            cls.browser.screenshot(picture)
            cls.browser.resize(1366, 900)
        return cls.browser.run("return [...document.querySelectorAll('.js-plotly-plot')].map(p => p.id)"), errors

    def text(self, selector):
        return self.browser.run("return document.querySelector(arguments[0]).innerText", selector)

    def traces(self, plot):
        """Name and number of points of each trace; a name may come twice in subplots."""
        return self.browser.run(
            "return document.getElementById(arguments[0]).data.map(d => [d.name, d.x.length])", plot)
