#!/usr/bin/python3
"""Runs a program on all that must not change, and tells what differs from another program's run.

    scripts/freeze/run.py --build=before --work=/tmp/before
    scripts/freeze/run.py --build=build --work=/tmp/after --against=/tmp/before [--jobs=2] [--only=blind_imu,speed]

Runs both blind sets, the measured flights, the coverage and the speeds. With `--against` the result files are
compared, decision by decision. Exit code 0: all are the same; 1: some differ. What has a result in --work is
not run again, so that a run that was killed goes on where it stopped. `--flights=20` runs and compares the first
20 flights of the blind sets and the coverage, for a quick look. Measured flights are read from TRUELINE_DATA
(default: ../shared/data beside the source folder). See README.md here.
"""
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.append(str(Path(__file__).resolve().parents[1] / "blind"))

import decisions
import judge
import program
from parts import PARTS

FLIGHTS = 100


def parse():
    parser = program.flags(__doc__, jobs=2, only=",".join(PARTS), flights=FLIGHTS)
    parser.add_argument("--against", type=Path, help="--work of the other program, to compare with")
    arguments = program.parse(parser)
    arguments.only = arguments.only.split(",")
    unknown = set(arguments.only) - set(PARTS)
    if unknown:
        parser.error(f"--only: {', '.join(unknown)} is unknown; use {', '.join(PARTS)}")
    return arguments


def print_rates(part, before, after):
    was, now = (judge.tallies(judge.read(work / part)) for work in (before, after))
    print(f"{part + ', rates':<84}{'before':>16}{'now':>16}")
    for what in dict.fromkeys([*was, *now]):
        print(f"  {what:<82}{str(was[what]):>16}{str(now[what]):>16}")


def print_changes(part, comparison):
    for flight, what, was, now, note in comparison.changed + comparison.speeds:
        print(f"{part}  {flight}  {what}: {was} -> {now}" + (f"  [{note}]" if note else ""))
    print(f"{part}: {comparison.same} the same, {len(comparison.changed)} changed, {len(comparison.speeds)} speeds "
          "beyond 15 %")


def compare_part(arguments, part):
    """Whether all decisions are the same."""
    was, now = (decisions.read(work, part) for work in (arguments.against, arguments.work))
    some = arguments.flights != FLIGHTS
    comparison = decisions.compare(was, now, some)
    if part.startswith("blind") and not some:
        print_rates(part, arguments.against, arguments.work)
    print_changes(part, comparison)
    return not comparison.changed


def main():
    arguments = parse()
    arguments.work.mkdir(parents=True, exist_ok=True)
    program.refuse_other_program(arguments)
    for part in arguments.only:
        start = time.monotonic()
        PARTS[part](arguments)
        print(f"{part}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    return 0 if not arguments.against else int(not all([compare_part(arguments, part) for part in arguments.only]))


if __name__ == "__main__":
    sys.exit(main())
