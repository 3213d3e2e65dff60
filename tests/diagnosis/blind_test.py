#!/usr/bin/python3
"""A small blind set, always the same, four flights with mocap in the log and four without: no false
cause, and nearly all hidden effects named."""
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCE = Path(os.environ["TRUELINE_TEST_SOURCE_DIR"])
BUILD = Path(os.environ["TRUELINE_TEST_BUILD_DIR"])
sys.path.insert(0, str(SOURCE / "scripts/blind"))
sys.dont_write_bytecode = True

from judge import named, read, times_detectable


def judge(fit, seed, count):
    """How many effects of at least twice their detectable size were hidden and named."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        subprocess.run(["/usr/bin/python3", SOURCE / "scripts/blind/run.py", f"--build={BUILD}",
                        f"--work={work}", f"--flights={count}", f"--seed={seed}", f"--fit={fit}", "--jobs=2"],
                       check=True, capture_output=True)
        flights = list(read(work))
    assert len(flights) >= 0.8 * count, f"{fit}: only {len(flights)} flights were flown and diagnosed"
    seen = hits = 0
    for hidden, diagnosis in flights:
        causes, effects = named(diagnosis), hidden["effects"]
        if not effects:
            assert not causes, f"{fit}, {hidden['course']}: nothing is hidden, yet {causes} is named"
        elif len(effects) == 1 and times_detectable(effects[0], diagnosis) >= 2:
            seen += 1
            hits += bool(causes) and effects[0]["id"] in causes[0]
    print(f"{fit}: {len(flights)} flights, {hits} of {seen} effects named")
    return seen, hits


def main():
    outcomes = [judge("fixes", 3, 4), judge("alone", 204, 4)]
    seen, hits = map(sum, zip(*outcomes))
    assert seen >= 3 and hits >= 0.75 * seen, f"{hits} of {seen} hidden effects are named"


if __name__ == "__main__":
    main()
