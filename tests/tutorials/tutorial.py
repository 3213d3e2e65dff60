"""Follows a tutorial of the handbook as a reader would: `tutorial.py PAGE` checks what the page shows, and
`tutorial.py --print PAGE` prints what its commands say.

A block of YAML is the reader's map.yaml, blocks of commands run one after the other, and each block of output is
looked for, line by line, in what the commands before it have said.
"""
import contextlib
import os
import pty
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

sys.path.append(str(Path(__file__).resolve().parents[1] / "result"))

from schemas import complaints

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
PROGRAMS = Path(os.environ.get("TRUELINE_PROGRAMS", BUILD / "apps"))
BLOCK = re.compile(r"```(sh|text|yaml)\n(.*?)```", re.S)


def on_a_terminal(command, folder):
    """What a command writes to a terminal, both streams."""
    reader, terminal = pty.openpty()
    run = subprocess.Popen(command, cwd=folder, stdout=terminal, stderr=terminal)
    os.close(terminal)
    text = b""
    with contextlib.suppress(OSError):  # the end of a terminal
        while part := os.read(reader, 1 << 16):
            text += part
    os.close(reader)
    assert run.wait() == 0, text
    return text.decode()


def squeezed(text):
    return re.sub(r"\s+", " ", text).strip()


def follow(page, folder):
    """Yields (commands, what they said, the outputs that the page shows of them)."""
    environment = {**os.environ, "PATH": f"{PROGRAMS}:/usr/bin:/bin"}
    commands = said = None
    shown = []
    for kind, text in BLOCK.findall((SOURCE / "config/handbook" / page).read_text()):
        if kind == "yaml":
            (folder / "map.yaml").write_text(text)
        elif kind == "text" and commands:
            shown.append(text)
        elif kind == "sh":
            if commands:
                yield commands, said, shown
            outcome = subprocess.run(["bash", "-euc", text], cwd=folder, env=environment, text=True,
                                     stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            assert outcome.returncode == 0, text + outcome.stdout
            commands, said, shown = text, outcome.stdout, []
    if commands:
        yield commands, said, shown


class Tutorial(unittest.TestCase):
    """A page whose commands are run once; what each of them says is compared with what the page shows."""

    @classmethod
    def setUpClass(cls):
        cls.root = Path(tempfile.mkdtemp(prefix="trueline_tutorial_"))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        cls.steps = list(follow(PAGE, cls.root))

    def result(self, name):
        return yaml.safe_load((self.root / name).read_text())

    def test_what_the_page_shows_is_said(self):
        compared = 0
        for commands, said, shown in self.steps:
            for line in (line for text in shown for line in text.splitlines() if line != "..."):
                compared += 1
                self.assertIn(squeezed(line), squeezed(said), commands)
        self.assertGreater(compared, 5)

    def test_results_are_as_their_schemas_say(self):
        for name in ("inspection/inspection", "calibration/calibration", "calibration/model", "diagnosis/diagnosis",
                     "diagnosis/model", "diagnosis/manifest", "flight.truth"):
            self.assertEqual(complaints(self.root / f"{name}.yaml"), [], name)

    def test_the_causes_are_those_that_were_hidden(self):
        flown = [effect["id"] for effect in self.result("flight.truth.yaml")["effects"]]
        self.assertEqual([cause["id"] for cause in self.result("diagnosis/diagnosis.yaml")["causes"]], flown)

    def test_messages_and_progress_land_between_the_lines_of_a_result(self):
        if PAGE != "laboratory.md":
            self.skipTest("one page is enough")
        config = SOURCE / "config"
        for words in (["convert", "--map=map.yaml", "--in=flight.csv", "--out=log_again"],
                      ["inspect", "--log=log", "--out=again", "--report=false"],
                      ["calibrate", "--log=log", "--out=again"],
                      ["diagnose", "--log=log", "--out=again", "--verbose", "--report=false"],
                      ["observe", f"--config={config}/observe/li2019.yaml", "--out=again", "--report=false"],
                      ["design", f"--config={config}/design/quick.yaml", "--out=again", "--report=false"],
                      ["benchmark", f"--config={config}/experiments/figure13.yaml", "--out=again_too", "--short"]):
            command = [PROGRAMS / "trueline", *words]
            apart = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
            together = subprocess.run(command, cwd=self.root, check=True, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True).stdout
            said = [line.rstrip() for line in apart.stdout.splitlines() if " in " not in line]  # how long it took differs
            self.assertTrue(said, words)
            for where, text in (("a file", together), ("a terminal", on_a_terminal(command, self.root))):
                lines = [line.rstrip() for line in re.split(r"[\r\n]+", text)]
                for line in said:
                    self.assertIn(line, lines, f"{words[0]} to {where}")
            if words[0] == "calibrate":
                self.assertIn("warning: ", apart.stderr)


if __name__ == "__main__":
    PAGE = sys.argv.pop()
    if "--print" not in sys.argv:
        unittest.main()
    with tempfile.TemporaryDirectory() as made:
        for commands, said, _ in follow(PAGE, Path(made)):
            print(f"$ {commands}{said}")
