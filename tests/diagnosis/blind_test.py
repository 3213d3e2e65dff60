#!/usr/bin/python3
"""A small blind set, always the same, ten flights with mocap in the log and ten without: no cause on
flights that hide nothing, nearly all hidden effects named first, sizes as certain as stated.

The limits are lower ends of 95 % bands around the rates of the large blind sets (scripts/blind/README.md):
94 % of effects at twice their detectable size named first, 92 % of sizes within 2 sigma."""
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])
sys.path.insert(0, str(SOURCE / "scripts/blind"))
sys.dont_write_bytecode = True

from judge import AMONG, FALSE, WITHIN, read, tallies

FLIGHTS = 10  # of a fit; a multiple of ten has each kind of flight in its share (run.py: plan)


def fly_and_diagnose(fit, seed):
    """(hidden, diagnosis) of each flight."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["/usr/bin/python3", SOURCE / "scripts/blind/run.py", f"--build={BUILD}", f"--work={folder}",
                        f"--flights={FLIGHTS}", f"--seed={seed}", f"--fit={fit}", "--jobs=2"],
                       check=True, capture_output=True)
        flights = list(read(Path(folder)))
    assert len(flights) >= 0.8 * FLIGHTS, f"{fit}: only {len(flights)} flights were flown and diagnosed"
    return flights


def least(count, rate):
    """Of `count` trials that succeed at `rate`: the lower end of the 95 % band of the successes."""
    chance, k = 0.0, -1
    while chance <= 0.05:
        k += 1
        chance += math.comb(count, k) * rate**k * (1.0 - rate) ** (count - k)
    return k


def main():
    tally = tallies(fly_and_diagnose("fixes", 3) + fly_and_diagnose("alone", 204))
    for what, result in tally.items():
        print(f"{what}: {result}")
    false, first, sizes = tally[FALSE], tally[f"{AMONG}: all"], tally[WITHIN]
    assert not false.good, f"nothing is hidden in {false.good} of {false.all} flights that get a cause"
    assert first.all >= 6, f"only {first.all} hidden effects are large enough to count"
    assert first.good >= least(first.all, 0.94), f"{first} hidden effects are named first"
    assert sizes.good >= least(sizes.all, 0.92), f"{sizes} sizes are within 2 sigma"


if __name__ == "__main__":
    main()
