"""What a run decided, kept as a YAML file for each part."""
import yaml

from program import read_yaml


def path_of(part, folder):
    return folder / f"{part}.yaml"


def as_kept(outcome):
    """The outcome as reading it back would give it."""
    return yaml.safe_load(yaml.safe_dump(outcome))


def write(part, outcome, folder):
    """`outcome`: blocks by name, each a mapping of records."""
    folder.mkdir(parents=True, exist_ok=True)
    path_of(part, folder).write_text(yaml.safe_dump(outcome, sort_keys=False))


def read(part, folder):
    return read_yaml(path_of(part, folder)) if path_of(part, folder).exists() else {}
