#!/usr/bin/python3
"""Freezes what the program decides, and tells what a change of the program changes.

    scripts/freeze/run.py --build=before --work=/tmp/before --kept=/tmp/kept --keep
    scripts/freeze/run.py --build=build --work=/tmp/after --kept=/tmp/kept [--jobs=2] [--only=blind_imu,speed]

Runs both blind sets, the measured flights, the coverage and the speeds. `--keep` writes the outcome to
--kept; without it the outcome is compared with what another program left there, decision by decision.
Exit code 0: kept, or all are the same; 1: some differ. What has a result in --work is not run again, so that a
run that was killed goes on where it stopped. `--flights=20` runs and compares the first 20 flights of
the blind sets and the coverage, for a quick look. Measured flights are read from TRUELINE_DATA
(default: ../shared/data beside the source folder). See README.md here.
"""
import argparse
import os
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True

import kept
import part_blind
import part_coverage
import part_measured
import part_speed
from compare import compare
from program import SOURCE, refuse_other_program
from report import print_changes, print_rates, print_table

PARTS = {
    "blind_imu": lambda a: part_blind.run(a, "imu"),
    "blind_rotors": lambda a: part_blind.run(a, "rotors"),
    "measured_imu": part_measured.run_imu,
    "coverage": part_coverage.run,
    "measured_rotors": part_measured.run_rotors,
    "speed": part_speed.run,
}
FLIGHTS = 100
SUMS = ("rates", "coverage")  # over all flights


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--work", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time; speeds go one by one")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, separated by commas")
    parser.add_argument("--kept", type=Path, required=True, help="folder of kept decisions")
    parser.add_argument("--keep", action="store_true", help="the outcome becomes the kept decisions")
    parser.add_argument("--flights", type=int, default=FLIGHTS, help="of a blind set, the coverage")
    arguments = parser.parse_args()
    arguments.data = Path(os.environ.get("TRUELINE_DATA", SOURCE.parent / "shared/data")).resolve()
    arguments.build, arguments.work = arguments.build.resolve(), arguments.work.resolve()
    arguments.only = arguments.only.split(",")
    unknown = set(arguments.only) - set(PARTS)
    if unknown:
        parser.error(f"--only: {', '.join(unknown)} is unknown; use {', '.join(PARTS)}")
    return arguments


def records(outcome, without=("rates",)):
    """Of all blocks by name; rates follow from the flights and are no decisions."""
    return {name: record for block, entries in outcome.items() if block not in without
            for name, record in (entries or {}).items()}


def comparable(arguments, was, now):
    """Records of both runs; of a quick look only those of flights that it ran."""
    if arguments.flights == FLIGHTS:
        return records(was), records(now)
    now = records(now, SUMS)
    return {name: record for name, record in records(was, SUMS).items() if name in now}, now


def run_part(arguments, part):
    """(what was kept, what is now)."""
    start = time.monotonic()
    was, now = kept.read(part, arguments.kept), kept.as_kept(PARTS[part](arguments))
    print(f"{part}: {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)
    if arguments.keep:
        kept.write(part, now, arguments.kept)
    return was, now


def main():
    arguments = parse()
    arguments.work.mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    outcomes = {part: run_part(arguments, part) for part in PARTS if part in arguments.only}
    pairs = {part: comparable(arguments, *outcome) for part, outcome in outcomes.items()}
    comparisons = {part: compare(*pair) for part, pair in pairs.items()}
    for part, (was, now) in outcomes.items():
        if arguments.flights == FLIGHTS:
            print_rates(part, was.get("rates", {}), now.get("rates", {}))
    for part, pair in pairs.items():
        print_changes(part, comparisons[part], *pair)
    print_table(comparisons)
    return int(not arguments.keep and any(comparisons[part].changed for part in comparisons if part != "speed"))


if __name__ == "__main__":
    sys.exit(main())
