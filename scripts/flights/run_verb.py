#!/usr/bin/python3
"""Runs one verb on one flight and states how it ended, in a YAML file that the merge reads.

    run_verb.py --apps=FOLDER --status=FILE VERB FLAGS...

A flight that gives no result (exit codes 2 and 3) is a result of the fleet: the code and the message
go to the file. Anything else, such as a kill, leaves no file and is run again.
"""
import argparse
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import yaml

from fleet import find_program


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--apps", default="")
    parser.add_argument("--status", type=Path, required=True)
    parser.add_argument("verb")
    return parser.parse_known_args()


def run(program, flags):
    start = time.monotonic()
    done = subprocess.run([program, *flags, "--quiet"], capture_output=True, text=True,
                          errors="replace")
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.returncode, {"code": done.returncode, "message": done.stderr.strip(),
                             "seconds": round(time.monotonic() - start, 3),
                             "cpu_seconds": round(used.ru_utime + used.ru_stime, 3),
                             "memory_mb": round(used.ru_maxrss / 1024)}


def main():
    arguments, flags = parse_arguments()
    program = find_program(arguments.apps, arguments.verb)
    if program is None:
        print(f"trueline-{arguments.verb} is neither in '{arguments.apps}' nor in PATH",
              file=sys.stderr)
        return 2
    code, status = run(program, flags)
    if code not in (0, 2, 3):
        print(f"{' '.join([program, *flags])}: ended with {code}: {status['message']}",
              file=sys.stderr)
        return 1
    temporary = arguments.status.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(yaml.safe_dump(status, sort_keys=False))
    temporary.replace(arguments.status)
    return 0


if __name__ == "__main__":
    sys.exit(main())
