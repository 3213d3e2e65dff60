"""Runs the program's executables, each once: what has an outcome is not run again."""
import argparse
import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import yaml

SOURCE = Path(__file__).resolve().parents[2]
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def read_yaml(path):
    return yaml.load(Path(path).read_text(), Loader=LOADER)


def flags(doc, **more):
    """A parser with --build, --work and `more`, each by its default; a tuple holds the choices."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=Path, default=SOURCE / "build")
    parser.add_argument("--work", type=Path, required=True, help="folder of the runs")
    for name, default in more.items():
        how = ({"choices": default, "default": default[0]} if isinstance(default, tuple) else
               {"action": "store_true"} if isinstance(default, bool) else {"type": type(default), "default": default})
        parser.add_argument(f"--{name}", **how)
    return parser


def parse(parser):
    arguments = parser.parse_args()
    arguments.data = Path(os.environ.get("TRUELINE_DATA", SOURCE.parent / "shared/data")).resolve()
    arguments.build, arguments.work = arguments.build.resolve(), arguments.work.resolve()
    return arguments


def app(arguments, verb):
    return str(arguments.build / "apps" / f"trueline-{verb}")


def drawn_effects(build, drive):
    """{id: {parameter: (low, high, either sign)}} of the effects that the blind sets hide, in declared
    order. Sizes are drawn log-uniformly. They range from undetectable to a few times the detectable size;
    pairs of the IMU-driven set use the upper half."""
    listed = subprocess.run([build / "apps/trueline-effects", "--yaml", f"--drive={drive}"],
                            capture_output=True, text=True, check=True).stdout
    return {effect["id"]: {name: (size["low"], size["high"], size["either_sign"])
                           for name, size in effect["drawn"].items()}
            for effect in yaml.safe_load(listed) if "drawn" in effect}


def environment(arguments):
    return {**os.environ, "TRUELINE_DATA": str(arguments.data), "OMP_NUM_THREADS": "1"}


def run_once(arguments, command, folder):
    """Exit code of `command`, whose results go to `folder`; the last line of its errors is kept."""
    outcome = folder / "outcome.yaml"
    if not outcome.exists():
        folder.mkdir(parents=True, exist_ok=True)
        ran = subprocess.run([str(word) for word in command], env=environment(arguments),
                             capture_output=True, text=True, check=False)
        if -ran.returncode in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            raise KeyboardInterrupt(f"{command[0]} was stopped")  # no outcome of the program
        errors = ran.stderr.strip().split("\n")[-1]
        part = outcome.with_suffix(".part")
        part.write_text(yaml.safe_dump({"exit": ran.returncode, "errors": errors}))
        part.rename(outcome)
    return read_yaml(outcome)["exit"]


def clear_left_over(log):
    """Removes the streams of a log whose writer was killed: log.yaml is written last, and no program
    writes into a folder of streams without one."""
    if not (log / "log.yaml").exists():
        shutil.rmtree(log, ignore_errors=True)


def convert_once(arguments, map_name, files, out):
    """Converts a measured flight by a shipped map to the native log `out`, which keeps the outcome."""
    if not (out / "outcome.yaml").exists():
        clear_left_over(out)
    run_once(arguments, [app(arguments, "convert"), f"--map={SOURCE}/config/import/{map_name}.yaml",
                         "--in=" + ",".join(map(str, files)), f"--out={out}", "--quiet"], out)


def run_script(arguments, command):
    """A script of the project, which goes on where it stopped by itself. Its standard output."""
    ran = subprocess.run([str(word) for word in command], env=environment(arguments),
                         stdout=subprocess.PIPE, text=True, check=True)
    return ran.stdout


def processor_seconds(arguments, command):
    """User time of `command`."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run_script(arguments, command)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def fingerprint(arguments):
    """Of what decides the results: executables and shipped configurations."""
    digest = hashlib.sha256()
    files = sorted((arguments.build / "apps").glob("*trueline*")) + sorted(SOURCE.glob("config/*/*"))
    for file in files:
        if file.is_file():
            digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


def refuse_other_draw(work, stated):
    """Flights of another draw in the same folder would pass for this one's. `stated`: what decides it."""
    file = work / "draw.yaml"
    if not file.exists():
        file.write_text(yaml.safe_dump(stated))
    if read_yaml(file) != stated:
        sys.exit(f"{work} holds results of {read_yaml(file)}; give another folder")


def refuse_other_program(arguments):
    """Results of another program in the same folder would pass for this one's."""
    if not os.access(app(arguments, "diagnose"), os.X_OK):
        sys.exit(f"no program in {arguments.build}; build first, by scripts/build")
    stated, found = arguments.work / "program.sha256", fingerprint(arguments)
    if not stated.exists():
        stated.write_text(found)
    if stated.read_text() != found:
        sys.exit(f"{arguments.work} holds results of another program; give another folder")
