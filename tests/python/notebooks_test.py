#!/usr/bin/python3
"""Runs the code cells of every notebook, as Jupyter would: each notebook in a process of its own."""
import json
import os
import subprocess
import sys
import unittest
from pathlib import Path

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
MODULE = Path(os.environ["TRUELINE_TEST_BUILD_DIR"]) / "python"
# The value of a cell's last line is shown: a page must be a page.
SHOW = """
import ast
def run_cell(source, names):
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
        html = getattr(value, "_repr_html_", None)
        print(len(html()) if html else repr(value))
names = {}
"""


class Notebooks(unittest.TestCase):
    def test_every_cell_runs(self):
        notebooks = sorted((SOURCE / "scripts/notebooks").glob("*.ipynb"))
        self.assertGreaterEqual(len(notebooks), 2)
        for notebook in notebooks:
            cells = [cell for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
            program = SHOW + "\n".join(f"run_cell({''.join(cell['source'])!r}, names)" for cell in cells)
            done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False,
                                  env={**os.environ, "PYTHONPATH": str(MODULE)})
            self.assertEqual(done.returncode, 0, f"{notebook.name}: {done.stderr}")


if __name__ == "__main__":
    if not MODULE.exists():
        print("SKIPPED: the Python module is not built")
        sys.exit(0)
    unittest.main()
