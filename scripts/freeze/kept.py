"""The kept files: YAML, a line or a few for each flight, so that a difference is one of few lines."""
import json
import math
import re
from pathlib import Path

import yaml

from program import read_yaml

HERE = Path(__file__).resolve().parent
WIDTH = 110


def path_of(part, folder=HERE):
    return Path(folder) / f"{part}.yaml"


def line(name, record):
    """Lines break after commas alone: YAML allows no break within a key."""
    text = yaml.safe_dump(record, default_flow_style=True, sort_keys=False, width=math.inf).strip()
    lines = [f"  {json.dumps(name)}:"]
    for piece in re.split(r"(?<=,) ", text):
        if len(lines[-1]) + 1 + len(piece) > WIDTH:
            lines.append("   ")
        lines[-1] += f" {piece}"
    return "\n".join(lines)


def text_of(outcome, about):
    """`outcome`: blocks by name, each a mapping of records."""
    lines = [f"# {about}"]
    for block, records in outcome.items():
        lines += [f"{block}:", *(line(name, record) for name, record in records.items())]
    return "\n".join(lines) + "\n"


def as_kept(outcome):
    """The outcome as reading it back would give it."""
    return yaml.safe_load(text_of(outcome, ""))


def write(part, outcome, about, folder=HERE):
    path_of(part, folder).write_text(text_of(outcome, about))


def read(part, folder=HERE):
    return read_yaml(path_of(part, folder)) if path_of(part, folder).exists() else {}
