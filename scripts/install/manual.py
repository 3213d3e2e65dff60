#!/usr/bin/python3
"""Writes the manual page of a program from its --help: manual.py PROGRAM FOLDER.

The page is FOLDER/PROGRAM.1.gz: the first sentence is the NAME, the text with its examples the
DESCRIPTION, the list of flags the OPTIONS. cmake --install runs it for every program.
"""
import gzip
import re
import subprocess
import sys
from pathlib import Path

FLAG = re.compile(r"  --(\S+) +(.*)")


def escaped(text):
    """Text in roff: no backslash, and no line that starts as a request."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)


def help_of(program, flag):
    return subprocess.run([program, flag], check=True, capture_output=True, text=True).stdout


def options(lines):
    for line in lines:
        flag = FLAG.match(line)
        yield (f".TP\n\\fB\\-\\-{escaped(flag[1])}\\fR\n{escaped(flag[2])}" if flag
               else escaped(line.strip()))


def page(name, version, text):
    text = text.removeprefix(f"{name}: ").strip()
    about, _, flags = text.partition("\n\nFlags:\n")
    first = re.split(r"[.:]?\n|\. ", about)[0]
    parts = [f'.TH {name.upper()} 1 "" "Trueline {version}" "Trueline"',
             f".SH NAME\n{escaped(name)} \\- {escaped(first[0].lower() + first[1:])}",
             f".SH SYNOPSIS\n.B {escaped(name)}\n[\\-\\-\\fIflag\\fR=\\fIvalue\\fR ...]",
             f".SH DESCRIPTION\n.nf\n{escaped(about)}\n.fi"]
    if flags:
        parts.append(".SH OPTIONS\n" + "\n".join(options(flags.splitlines())))
    parts.append(".SH SEE ALSO\n.BR trueline (1)")
    return "\n".join(parts) + "\n"


def main(program, folder):
    name = Path(program).name
    version = help_of(program, "--version").split()[-1]
    out = Path(folder) / f"{name}.1.gz"
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(gzip.compress(page(name, version, help_of(program, "--help")).encode(), 9,
                                  mtime=0))


if __name__ == "__main__":
    main(*sys.argv[1:])
