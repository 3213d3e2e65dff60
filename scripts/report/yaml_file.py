"""Reading of a YAML mapping."""
import yaml

from errors import ReportError


def read_mapping(path, remedy="give the folder of a finished run"):
    try:
        with open(path, encoding="utf-8") as stream:
            content = yaml.load(stream, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except FileNotFoundError as error:
        raise ReportError(f"{path}: no such file; {remedy}") from error
    except (yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        raise ReportError(f"{path}: {error}") from error
    if not isinstance(content, dict):
        raise ReportError(f"{path}: expected a mapping (key: value)")
    return content
