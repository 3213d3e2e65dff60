#!/usr/bin/python3
"""Takes every log of some folders through convert, inspect and calibrate, as a user would.

    scripts/logs_table.py --build=build --out=OUT FOLDER|LOG...

A log is a file, or a folder that holds `metadata.yaml` (ROS 2 bag) or `mav0` (ASL). Each is listed
(`convert --in=LOG`), converted without a map, inspected and calibrated. A log whose shipped map needs --map is converted by the first entry of MAPS whose
pattern its path contains. Output of every command goes to OUT/NAME/VERB.txt, the table to
OUT/table.md. Exit code 1 if a command ended with a code other than 0, 2 or 3 (a defect).
"""
import argparse
import os
import re
import resource
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
import yaml

SOURCE = Path(__file__).resolve().parents[1]
NO_LOG = {".md", ".yaml", ".yml", ".json", ".proto", ".gz"}
ANSWERS = {0, 2, 3}  # done, bad input, no usable result
MAPS = {"li_bebop_drag/": "li_bebop_drag", "li_bebop_gate/": "li_bebop_gate",
        "li_trashcan_race/": "li_trashcan_race"}  # columns without names: no map can be found


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("logs", type=Path, nargs="+")
    return parser.parse_args()


def logs_in(path):
    """The logs of a folder, in order of their names."""
    if path.is_file():
        companion = path.name.startswith("take_") and path.with_name(path.name[5:]).exists()
        apart = path.suffix in NO_LOG or path.name.startswith("LICENSE") or companion
        return [] if apart else [path]
    if (path / "metadata.yaml").exists() or (path / "mav0").exists():
        return [path]
    if path.name == "licences":
        return []
    return [log for inner in sorted(path.iterdir()) for log in logs_in(inner)]


def run(arguments, folder, verb, *flags):
    """Exit code and the lines that the verb wrote; processor time in s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [str(arguments.build / "apps" / f"trueline-{verb}"), *flags]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, errors="replace", check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    folder.mkdir(parents=True, exist_ok=True)
    name = verb if "--out" in "".join(flags) else "list"
    (folder / f"{name}.txt").write_text(f"{' '.join(command)}\nexit {done.returncode}, "
                                        f"{seconds:.2f} s\n{done.stdout}")
    return done.returncode, done.stdout


def reason(output, log):
    """The line that says why a verb made no result."""
    lines = [line for line in output.splitlines() if re.match(r"trueline-\w+: ", line)]
    text = re.sub(r"trueline-\w+: (error: )?(no usable log: )?", "", lines[-1] if lines else "")
    return text.replace(str(log), "").strip(": ")


def findings_of(folder):
    file = folder / "inspection.yaml"
    if not file.exists():
        return "-"
    findings = yaml.safe_load(file.read_text()).get("findings") or []
    told = [f"{f['id']} of {f['stream']} ({f['size']} {f['unit']})" for f in findings
            if f["level"] != "note"]
    return "; ".join(told) or "none"


def verdict_of(folder):
    file = folder / "calibration.yaml"
    if not file.exists():
        return ""
    result = yaml.safe_load(file.read_text())
    return f"{result.get('verdict', '')}"


def map_of(log):
    return next((f"--map={SOURCE}/config/import/{name}.yaml" for pattern, name in MAPS.items()
                 if pattern in str(log)), None)


def inputs_of(log):
    """Bebop's logs come with a file of mocap beside them."""
    take = log.with_name(f"take_{log.name}")
    return f"{log},{take}" if take.exists() else str(log)


def row(arguments, log, name):
    folder = arguments.out / name
    codes = {"list": run(arguments, folder, "convert", f"--in={log}")[0]}
    native = folder / "log"
    with_map = [map_of(log)] if map_of(log) else []
    codes["convert"], said = run(arguments, folder, "convert", f"--in={inputs_of(log)}",
                                 f"--out={native}", *with_map)
    result, found = reason(said, log), "-"
    if codes["convert"] == 0:
        codes["inspect"], _ = run(arguments, folder, "inspect", f"--log={native}",
                                  f"--out={folder}/inspection", "--report=false")
        found = findings_of(folder / "inspection")
        codes["calibrate"], said = run(arguments, folder, "calibrate", f"--log={native}",
                                       f"--out={folder}/calibration", "--report=false")
        result = verdict_of(folder / "calibration") or reason(said, native)
    ended = ", ".join(f"{verb} {code}" for verb, code in codes.items())
    return f"| {name} | {ended} | {found} | {result} |", set(codes.values()) <= ANSWERS


def main():
    arguments = parse()
    lines = ["| log | exit codes | findings above a note | result, or why there is none |",
             "|---|---|---|---|"]
    good = True
    for root in arguments.logs:
        for log in logs_in(root):
            name = str(log.relative_to(root.parent)) if root.is_dir() else log.name
            line, answered = row(arguments, log, name)
            lines.append(line)
            good = good and answered
            print(line, flush=True)
    (arguments.out / "table.md").write_text("\n".join(lines) + "\n")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
