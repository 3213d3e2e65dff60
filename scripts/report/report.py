#!/usr/bin/python3
"""Renders a result folder as one HTML page that opens offline, or as a file of another format.

    report.py calibration --result=DIR --log=LOGDIR --out=FILE

Each verb is a module with build(arguments) -> Document; add_arguments(parser) where it needs more.
The page is written under a temporary name and renamed. Exit codes: 0 done, 2 bad input or usage.
"""
import argparse
import importlib
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # the scripts may be installed where the user can't write
sys.path.insert(0, str(Path(__file__).resolve().parent))

from errors import ReportError

VERBS = [
    "calibration", "rotors", "rotor_experiment", "benchmark", "observe", "design", "diagnosis",
    "multi_step", "wrench", "inspection", "audit", "picture", "tum", "mcap", "foreign_log",
]


def parse_arguments(argv):
    parser = argparse.ArgumentParser(prog="report.py", description=__doc__.split("\n")[0])
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for verb in VERBS:
        module = importlib.import_module(verb)
        sub = verbs.add_parser(verb, help=module.__doc__.split(":")[0])
        sub.add_argument("--result", required=True, type=Path,
                         help="the folder of a result or, to write a foreign log, a native log")
        if hasattr(module, "add_arguments"):
            module.add_arguments(sub)
        sub.add_argument("--out", required=True, type=Path, help="the file to write")
        sub.set_defaults(build=module.build)
    return parser.parse_args(argv)


def main(argv):
    arguments = parse_arguments(argv)
    try:
        arguments.build(arguments).write(arguments.out)
    except ReportError as error:
        print(f"report.py: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
