#!/usr/bin/python3
"""Breaks logs in all ways that mutations.py knows and looks at what the verbs make of them.

    scripts/knocks/mutate.py --logs=2000 --work=/tmp/mutate [--apps=build/apps] [--seed=1]
        [--first=0] [--numbers=N...] [--jobs=2] [--flight=short] [--foreign=FILE...]
        [--diagnose=0.1] [--calibrate=1] [--memory=6] [--cpu=120]

Each log is a simulated flight with one mutation in one file; it goes through calibrate and, for a
share, convert, inspect and diagnose. With --foreign, each log is one of these recordings with its
bytes changed, and goes through convert alone. A fault is a crash, a run over the limits, an error
without file and remedy in one line, and a wrong result in silence: verdict `usable`, no warning, and
an identified parameter further from that of the untouched log than its 95 % interval, or a cause
that the untouched log does not have. Prints a table, and the faults; WORK/faults keeps their logs,
WORK/events.csv lists all runs. A log depends on seed and number alone: --numbers makes some again.
With programs built with the address sanitizer, give --memory=0 and a higher --cpu. Exit code 1 if
there is a crash.
"""
import argparse
import collections
import csv
import random
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from broken_log import FLIGHTS, Base, knock_foreign, knock_native

SOURCE = Path(__file__).resolve().parents[2]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--logs", type=int, default=2000)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--apps", type=Path, default=SOURCE / "build/apps")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first log")
    parser.add_argument("--numbers", type=int, nargs="*", help="these logs, not --first and --logs")
    parser.add_argument("--flight", choices=FLIGHTS, default="hippodrome")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--foreign", type=Path, nargs="*", default=[])
    parser.add_argument("--diagnose", type=float, default=0.1, help="share of logs")
    parser.add_argument("--calibrate", type=float, default=1.0, help="share of logs")
    parser.add_argument("--memory", type=int, default=6, help="GB a run; 0 for no limit")
    parser.add_argument("--cpu", type=int, default=120, help="processor seconds a run")
    return parser.parse_args()


def work_on(base, arguments, number):
    """The events of one broken log: [(verb, mutation, kind, text)]."""
    draw = random.Random(f"{arguments.seed}/{number}")
    folder = arguments.work / f"log{number}"
    try:
        if arguments.foreign:
            return knock_foreign(base, draw.choice(arguments.foreign), folder, draw)
        return knock_native(base, folder, draw, draw.random() < arguments.diagnose,
                            arguments.calibrate)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def print_table(counts):
    kinds = sorted({kind for _, kind in counts})
    print(f"{'verb':<12}" + "".join(f"{kind:>16}" for kind in kinds))
    for verb in sorted({verb for verb, _ in counts}):
        print(f"{verb:<12}" + "".join(f"{counts[verb, kind]:>16}" for kind in kinds))


def collect(results, file):
    """Counts of (verb, kind), and the faults in words; lists all events in `file`."""
    counts, faults = collections.Counter(), []
    table = csv.writer(file)
    table.writerow(["log", "verb", "mutation", "kind", "text"])
    for number, events in results:
        for verb, mutation, kind, text in events:
            table.writerow([number, verb, mutation, kind, text])
            counts[verb, kind] += 1
            if kind in ("fault", "silently wrong"):
                faults.append(f"{verb}, {mutation}: {kind}: {text} (log {number})")
                print(faults[-1], file=sys.stderr, flush=True)
        file.flush()
    return counts, faults


def main():
    arguments = parse_arguments()
    arguments.work.mkdir(parents=True, exist_ok=True)
    base = Base(arguments.apps, SOURCE, arguments.work, arguments.memory, arguments.cpu,
                arguments.flight)
    numbers = arguments.numbers or range(arguments.first, arguments.first + arguments.logs)
    with ThreadPoolExecutor(arguments.jobs) as pool, \
            (arguments.work / "events.csv").open("w", newline="") as file:
        results = pool.map(lambda number: work_on(base, arguments, number), numbers)
        counts, faults = collect(zip(numbers, results), file)
    print_table(counts)
    print("\n".join(sorted(faults)))
    return 1 if any(": fault: " in fault for fault in faults) else 0


if __name__ == "__main__":
    sys.exit(main())
