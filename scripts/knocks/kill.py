#!/usr/bin/python3
"""Kills every verb at random moments and checks that a result folder stays whole.

    scripts/knocks/kill.py --kills=210 --work=/tmp/kills [--apps=build/apps] [--seed=1]

Each verb alternates between two inputs and writes into one folder, which also holds a file and a
folder of the user. A quarter of the kills come at any moment of the run, the others 0.1 ms to 0.5 s after
the last file was written, when the result takes its place. After each kill the folder must hold
the result from before or the new one: every file that manifest.yaml lists with the digest it
states and no other, or (native logs) the bytes of one of the two runs. Prints a table; exit code 1
if one folder was not whole.
"""
import argparse
import random
import subprocess
import sys
import time
from pathlib import Path

from whole import add_files_of_the_user, state_of
from verbs import make_inputs, verbs

SOURCE = Path(__file__).resolve().parents[2]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=210, help="over all verbs")
    parser.add_argument("--work", type=Path, required=True, help="a folder for logs and results")
    parser.add_argument("--apps", type=Path, default=SOURCE / "build/apps")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def stages(out):
    return list(out.parent.glob(f".{out.name}.part-*"))


def wait_for_the_end(process, out, last_file):
    """Until the hidden folder holds the file that is written last, or the process ends."""
    while process.poll() is None:
        if any((stage / last_file).exists() for stage in stages(out)):
            return
        time.sleep(0.0002)


def run_and_kill(verb, command, duration, draw):
    """Returns whether the kill came before the end."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                               start_new_session=True)
    if draw.random() < 0.25:
        time.sleep(draw.uniform(0.0, 1.1 * duration))
    else:
        wait_for_the_end(process, verb.out, verb.last_file)
        time.sleep(10.0 ** draw.uniform(-4.0, -0.3))
    process.kill()
    return process.wait() != 0


def reference(verb, command):
    """The run's result where nothing disturbs it, and how long it took."""
    start = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return state_of(verb.out), time.monotonic() - start


def knock(verb, kills, draw):
    """Kills one verb; returns (killed, ended first, results replaced, faults)."""
    add_files_of_the_user(verb.out)
    known, duration = [], 0.0
    for command in verb.commands:
        state, seconds = reference(verb, command)
        known.append(state)
        duration = max(duration, seconds)
    last, killed, replaced, faults = known[-1], 0, 0, []
    for i in range(kills):
        killed += run_and_kill(verb, verb.commands[i % 2], duration, draw)
        state = state_of(verb.out)
        if state.fault or state.key not in {one.key for one in known}:
            faults.append(f"{verb.name}, kill {i}: {state.fault or 'a mixture of two runs'}")
        replaced += state.key != last.key
        last = state
    reference(verb, verb.commands[0])  # the start after a kill
    if stages(verb.out):
        faults.append(f"{verb.name}: {len(stages(verb.out))} hidden folders are left over")
    return killed, kills - killed, replaced, faults


def main():
    arguments = parse_arguments()
    draw = random.Random(arguments.seed)
    make_inputs(arguments.apps, SOURCE, arguments.work)
    all_verbs = verbs(arguments.apps, SOURCE, arguments.work)
    each = -(-arguments.kills // len(all_verbs))
    print(f"{'verb':<12}{'killed':>8}{'ended first':>13}{'new result':>12}{'not whole':>11}")
    all_faults = []
    for verb in all_verbs:
        killed, ended, replaced, faults = knock(verb, each, draw)
        print(f"{verb.name:<12}{killed:>8}{ended:>13}{replaced:>12}{len(faults):>11}", flush=True)
        all_faults += faults
    print("\n".join(all_faults))
    return 1 if all_faults else 0


if __name__ == "__main__":
    sys.exit(main())
