"""Results against their JSON schemas, by Debian's jsonschema."""
import json
import os
from pathlib import Path

import jsonschema
import yaml

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
SCHEMAS = SOURCE / "config/schema"


def schema_of(file):
    """`flight.truth.yaml` is held against `truth`, `trajectory_best_Lissajous.yaml` against `trajectory`."""
    return SCHEMAS / f"{file.stem.split('.')[-1].split('_')[0]}.schema.json"


def complaints(file):
    """What the schema of a result file says against it."""
    validator = jsonschema.Draft202012Validator(json.loads(schema_of(file).read_text()))
    return [f"{'/'.join(map(str, error.path))}: {error.message}"
            for error in validator.iter_errors(yaml.safe_load(file.read_text()))]
