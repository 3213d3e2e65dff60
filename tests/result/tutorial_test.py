"""Runs the laboratory's tutorial as it is written, and holds its results against their schemas."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import jsonschema
import yaml

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
TUTORIAL = SOURCE / "config/handbook/laboratory.md"


def complaints(file):
    """What the schema of a result file says against it."""
    schema = json.loads((SOURCE / "config/schema" / f"{file.stem}.schema.json").read_text())
    validator = jsonschema.Draft202012Validator(schema)
    return [f"{'/'.join(map(str, error.path))}: {error.message}"
            for error in validator.iter_errors(yaml.safe_load(file.read_text()))]


class Tutorial(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = Path(tempfile.mkdtemp(prefix="trueline_tutorial_"))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        for name in ("config", "scripts"):
            (cls.root / name).symlink_to(SOURCE / name)
        text = TUTORIAL.read_text()
        (cls.root / "map.yaml").write_text(re.search(r"```yaml\n(.*?)```", text, re.S)[1])
        cls.said = ""
        environment = {**os.environ, "PATH": f"{BUILD / 'apps'}:/usr/bin:/bin"}
        for commands in re.findall(r"```sh\n(.*?)```", text, re.S):
            outcome = subprocess.run(["bash", "-euc", commands], cwd=cls.root, env=environment, capture_output=True,
                                     text=True)
            assert outcome.returncode == 0, commands + outcome.stderr
            cls.said += outcome.stdout + outcome.stderr

    def test_what_the_tutorial_shows_is_said(self):
        squeezed = re.sub(r"\s+", " ", self.said)
        for block in re.findall(r"```text\n(.*?)```", TUTORIAL.read_text(), re.S):
            for line in block.splitlines():
                if line != "...":
                    self.assertIn(re.sub(r"\s+", " ", line).strip(), squeezed)

    def test_results_are_as_their_schemas_say(self):
        for name in ("inspection/inspection", "inspection/manifest", "calibration/calibration", "calibration/model",
                     "calibration/manifest", "diagnosis/diagnosis", "diagnosis/model"):
            self.assertEqual(complaints(self.root / f"{name}.yaml"), [], name)

    def test_a_key_that_a_schema_lacks_is_found(self):
        result = yaml.safe_load((self.root / "calibration/calibration.yaml").read_text())
        result["new_key"] = result["arcs"]["new_key"] = 1
        changed = self.root / "changed" / "calibration.yaml"
        changed.parent.mkdir()
        changed.write_text(yaml.safe_dump(result))
        self.assertEqual(len(complaints(changed)), 2)

    def test_the_hidden_wind_is_named_with_what_to_do(self):
        result = yaml.safe_load((self.root / "diagnosis/diagnosis.yaml").read_text())
        self.assertEqual([cause["id"] for cause in result["causes"]], ["wind"])
        self.assertIn("use what was found", " ".join(result["next"]))


    def test_messages_land_between_the_lines_of_a_result(self):
        command = [BUILD / "apps/trueline", "calibrate", "--log=log", "--out=again", "--report=false"]
        apart = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        together = subprocess.run(command, cwd=self.root, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True).stdout.splitlines()
        self.assertIn("warning: ", apart.stderr)
        for line in (apart.stdout + apart.stderr).splitlines():
            self.assertIn(line, together)


class RotorSchemas(unittest.TestCase):
    def test_a_rotor_calibration_is_as_its_schema_says(self):
        with tempfile.TemporaryDirectory() as folder:
            for command in (["simulate", f"--config={SOURCE}/config/rotors/random.yaml", f"--out={folder}/log"],
                            ["calibrate", "--drive=rotors", f"--config={SOURCE}/config/calibrate/rotors.yaml",
                             f"--log={folder}/log", f"--out={folder}/result", "--report=false"]):
                subprocess.run([BUILD / "apps/trueline", *command, "--quiet"], check=True)
            for name in ("calibration", "model"):
                self.assertEqual(complaints(Path(folder) / "result" / f"{name}.yaml"), [])


if __name__ == "__main__":
    unittest.main()
