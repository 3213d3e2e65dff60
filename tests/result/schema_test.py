"""Every schema of config/schema holds for a real result, and refuses a key that it lacks."""
import csv
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import yaml

sys.path.insert(0, str(Path(__file__).resolve().parent))

from schemas import SCHEMAS, SOURCE, complaints, schema_of

sys.path.append(str(SOURCE / "scripts/handbook"))

import reference

BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
ROTORS = f"--config={SOURCE}/config/calibrate/rotors.yaml"
EXPERIMENT = {"name": "short", "simulations": [{"config": str(SOURCE / "config/simulate/hippodrome.yaml"),
                                                "overrides": {"duration": 30}}],
              "seeds": {"first": 1, "count": 2}, "estimators": [{"name": "vgd", "label": "VGD"}], "gammas": [3]}


class Schemas(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = Path(tempfile.mkdtemp(prefix="trueline_schemas_"))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        (cls.root / "experiment.yaml").write_text(yaml.safe_dump(EXPERIMENT))
        shown = SOURCE / "config"
        for command in (
                ["simulate", f"--config={shown}/simulate/iros2016.yaml", "--duration=40", "--out=flight"],
                ["inspect", "--log=flight", "--out=inspected"],
                ["calibrate", "--log=flight", "--out=calibrated"],
                ["diagnose", "--log=flight", "--out=diagnosed"],
                ["simulate", f"--config={shown}/rotors/random.yaml", "--out=rotors"],
                ["calibrate", "--drive=rotors", ROTORS, "--log=rotors", "--out=rotor_calibrated"],
                ["export", "--model=rotor_calibrated/model.yaml", "--to=rotorpy", "--out=rotorpy.yaml"],
                ["audit", "--simulator=rotorpy.yaml", "--out=audited"],
                ["observe", f"--config={shown}/observe/li2019.yaml", "--out=exact"],
                ["observe", "--log=rotors", "--out=observed"],
                ["observe", "--score=e2log", f"--config={shown}/observe/e2log.yaml", "--out=ranked"],
                ["design", f"--config={shown}/design/quick.yaml", "--out=designed"],
                ["benchmark", "--config=experiment.yaml", "--out=compared"],
                ["benchmark", "--short", f"--config={shown}/experiments/rotors_matched.yaml", "--out=trials"]):
            subprocess.run([BUILD / "apps/trueline", *command, "--quiet",
                            *(["--report=false"] if command[0] not in ("simulate", "export") else [])],
                           cwd=cls.root, check=True)

    def results(self):
        return [path for path in self.root.glob("**/*.yaml")
                if schema_of(path).exists() and "jobs" not in path.parts]

    def test_results_are_as_their_schemas_say(self):
        for path in self.results():
            self.assertEqual(complaints(path), [], path.relative_to(self.root))

    def test_every_schema_has_been_asked(self):
        self.assertEqual({schema_of(path) for path in self.results()}, set(SCHEMAS.iterdir()))

    def test_every_result_has_a_schema(self):
        known = {path.resolve() for path in self.results()}
        for manifest in self.root.glob("*/manifest.yaml"):
            for name in yaml.safe_load(manifest.read_text())["sha256"]:
                if name.endswith(".yaml") and name not in ("corrected_map.yaml", "rotorpy.yaml"):
                    self.assertIn((manifest.parent / name).resolve(), known)

    def test_every_column_has_a_description(self):
        describe = yaml.safe_load((SOURCE / "scripts/handbook/describe.yaml").read_text())
        described = set()
        for manifest in self.root.glob("*/manifest.yaml"):
            for table in manifest.parent.glob("*.csv"):
                described.add(table.stem)
                self.assertIn(table.stem, describe["tables"])
                for head in next(csv.reader([table.read_text().splitlines()[0]])):
                    self.assertTrue(reference.column_described(head, describe), (table.name, head))
        self.assertGreater(len(described), 8)
        self.assertFalse(reference.column_described("new [m]", describe))

    def test_a_key_that_a_schema_lacks_is_found(self):
        result = yaml.safe_load((self.root / "calibrated/calibration.yaml").read_text())
        result["new_key"] = result["arcs"]["new_key"] = 1
        changed = self.root / "calibration.yaml"
        changed.write_text(yaml.safe_dump(result))
        self.addCleanup(changed.unlink)
        self.assertEqual(len(complaints(changed)), 2)


if __name__ == "__main__":
    unittest.main()
