#!/usr/bin/python3
"""Writes verbs.py, a typed function for each verb, from the verbs' own flags and texts:
write_verbs.py PACKAGE_FOLDER (which holds the binding)."""
import keyword
import re
import sys
import textwrap
from pathlib import Path

HEAD = '''"""The verbs of the command line, with their flags as arguments. Written by write_verbs.py."""
from pathlib import Path

from .log import Log
from .result import Result
from .run import Folder, Text, run
'''
RETURNS = {"convert": "Log", "simulate": "Log", "export": "Path"}
TYPES = {bool: "bool", int: "int", float: "float", str: "Text"}


def argument(name, initial):
    """As in a signature; `in` is a word of Python's own."""
    python = name + "_" * keyword.iskeyword(name)
    if name == "out":
        return "out: Folder = None"
    # Results are objects here, so tables are printed on demand only.
    return f"{python}: {TYPES[type(initial)]} = {True if name == 'quiet' else repr(initial)}"


def function(name, usage, flags):
    """The first flag may stand without its name."""
    arguments = [argument(flag, initial) for flag, initial, _ in flags]
    kind = RETURNS.get(name, "Result")
    head = f"def {name}({arguments[0]}, *, {', '.join(arguments[1:])}) -> {kind}:"
    # A line ends between arguments only.
    lines = [line.replace("\0", " ") for line in textwrap.wrap(
        re.sub(r" (?!\w+: )", "\0", head), 110, subsequent_indent=" " * (5 + len(name)),
        break_long_words=False, break_on_hyphens=False)]
    about = usage[0].upper() + usage[1:]
    told = "\n".join(f"{flag + '_' * keyword.iskeyword(flag)}: {text}" for flag, _, text in flags)
    doc = textwrap.indent(f'r"""{about}\n\nArguments, by their names on the command line:\n\n{told}\n"""',
                          "    ", lambda line: bool(line.strip()))
    return "\n".join([*lines, doc, f'    return run("{name}", {kind}, locals())'])


def main(package):
    sys.path.insert(0, str(package))
    import _trueline as binding
    flags = {name: binding.flags(name) for name in sorted(binding.verbs)}
    # A verb without `out` only prints.
    names = [name for name in flags if any(flag == "out" for flag, _, _ in flags[name])]
    parts = [HEAD + f"\n__all__ = {names!r}\n"]
    parts += [function(name, binding.usage(name), flags[name]) for name in names]
    (package / "verbs.py").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
