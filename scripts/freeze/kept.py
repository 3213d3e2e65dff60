"""The kept files: YAML, a line or a few for each flight, so that a difference is one of few lines."""
import json
import math
from pathlib import Path

import yaml

from program import read_yaml

HERE = Path(__file__).resolve().parent
WIDTH = 110


def path_of(part, folder=HERE):
    return Path(folder) / f"{part}.yaml"


def scalar(node):
    return yaml.safe_dump([node], default_flow_style=True, width=math.inf).strip()[1:-1]


def enclosed(parts, brackets):
    """Pieces of all `parts`, with commas between them and brackets around."""
    flat = [piece for *head, last in parts for piece in (*head, f"{last},")]
    flat[-1] = flat[-1].removesuffix(",") + brackets[1]
    return [brackets[0] + flat[0], *flat[1:]]


def pieces(node):
    """Of YAML in flow style: texts between which a line may break."""
    if isinstance(node, dict) and node:
        parts = [(scalar(key), pieces(value)) for key, value in node.items()]
        return enclosed([[f"{key}: {first}", *rest] for key, (first, *rest) in parts], "{}")
    if isinstance(node, list) and any(isinstance(item, (dict, list)) for item in node):
        return enclosed([pieces(item) for item in node], "[]")
    return [scalar(node)]


def line(name, record):
    lines = [f"  {json.dumps(name)}:"]
    for piece in pieces(record):
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
