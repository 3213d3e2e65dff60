#!/usr/bin/python3
"""Kills every verb at random moments and checks that a result folder stays whole.

    scripts/knocks/kill.py --kills=207 --work=/tmp/kills [--apps=build/apps] [--seed=1]
        [--pairs=3]

Each verb alternates between two inputs and writes into one folder, which also holds a file and a
folder of the user. A quarter of the kills come at any moment of the run, the others 0.1 ms to 0.5 s
after the last file was written, when the result takes its place. Runs that end before their kill are
not counted. After each kill the folder must hold the result from before or the new one: every file
that manifest.yaml lists with the digest it states and no other, or (native logs) the bytes of one of
the two runs. A run after the kills must succeed and remove what they left. Then both inputs run into
the folder at the same time, --pairs times: it must hold the whole result of one, and one run may be
refused. Prints a table; exit code 1 if one folder was not whole.
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
    parser.add_argument("--kills", type=int, default=207, help="over all verbs")
    parser.add_argument("--pairs", type=int, default=3, help="runs at the same time, for each verb")
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


class Knocked:
    """A verb's folder, the results that it may hold, and what happened to it."""

    def __init__(self, verb):
        self.verb, self.known, self.duration, self.faults = verb, set(), 0.0, []
        self.killed = self.ended_first = self.replaced = self.pairs = 0
        add_files_of_the_user(verb.out)
        for command in verb.commands:
            state, seconds = reference(verb, command)
            self.known.add(state.key)
            self.duration = max(self.duration, seconds)
            self.last = state

    def look(self, when):
        state = state_of(self.verb.out)
        if state.fault or state.key not in self.known:
            self.faults.append(f"{self.verb.name}, {when}: {state.fault or 'a mixture of two runs'}")
        self.replaced += state.key != self.last.key
        self.last = state

    def kill(self, kills, draw):
        while self.killed < kills and self.killed + self.ended_first < 5 * kills:
            command = self.verb.commands[(self.killed + self.ended_first) % 2]
            if run_and_kill(self.verb, command, self.duration, draw):
                self.killed += 1
            else:
                self.ended_first += 1
            self.look(f"kill {self.killed}")

    def run_after_kills(self):
        reference(self.verb, self.verb.commands[0])
        self.look("the run after the kills")
        if stages(self.verb.out):
            self.faults.append(f"{self.verb.name}: {len(stages(self.verb.out))} hidden folders remain")

    def run_pairs(self, pairs):
        for _ in range(pairs):
            runs = [subprocess.Popen(command, stdout=subprocess.DEVNULL)
                    for command in self.verb.commands]
            codes = [run.wait() for run in runs]
            self.pairs += 1
            if sorted(codes) not in ([0, 0], [0, 2]):  # trueline-benchmark refuses the second run
                self.faults.append(f"{self.verb.name}: two runs at the same time ended with {codes}")
            self.look("two runs at the same time")


def main():
    arguments = parse_arguments()
    draw = random.Random(arguments.seed)
    make_inputs(arguments.apps, SOURCE, arguments.work)
    all_verbs = verbs(arguments.apps, SOURCE, arguments.work)
    each = -(-arguments.kills // len(all_verbs))
    print(f"{'verb':<12}{'killed':>8}{'ended first':>13}{'new result':>12}{'pairs':>7}{'faults':>8}")
    all_faults = []
    for verb in all_verbs:
        folder = Knocked(verb)
        folder.kill(each, draw)
        folder.run_after_kills()
        folder.run_pairs(arguments.pairs)
        print(f"{verb.name:<12}{folder.killed:>8}{folder.ended_first:>13}{folder.replaced:>12}"
              f"{folder.pairs:>7}{len(folder.faults):>8}", flush=True)
        all_faults += folder.faults
    print("\n".join(all_faults))
    return 1 if all_faults else 0


if __name__ == "__main__":
    sys.exit(main())
