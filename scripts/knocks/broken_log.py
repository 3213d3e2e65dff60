"""One broken log through the verbs, beside the untouched one."""
import os
import shutil
import subprocess
from functools import cached_property

import yaml

from foreign import inputs_of, write_map
from mutations import mutate
from run_verb import run_verb

WITHIN = 1.96  # sigmas
FLAGS = ["--report=false", "--quiet"]

# Of config/simulate/hippodrome.yaml: seconds, size and speed of the course, rates in Hz. The short
# flight has seven arcs, two more than the verdict `usable` needs, and costs a third. The tiny one is
# `poor`, so nothing of it can be silently wrong: it is for crashes under the sanitizers alone.
FLIGHTS = {"hippodrome": {"seconds": 40, "size": 1.0, "speed": 1.8, "imu": 200.0, "mocap": 120.0},
           "short": {"seconds": 15, "size": 0.6, "speed": 2.2, "imu": 100.0, "mocap": 40.0},
           "tiny": {"seconds": 9, "size": 0.6, "speed": 2.2, "imu": 100.0, "mocap": 40.0}}


class Base:
    """The untouched log with its results, and how verbs are called."""

    def __init__(self, apps, source, work, memory, cpu_seconds, flight):
        self.apps, self.work = apps, work
        self.memory, self.cpu_seconds = memory, cpu_seconds
        self.tiny = flight == "tiny"
        self.map = write_map(work / "map.yaml")
        self.log = work / "untouched"
        (work / "course.yaml").write_text(yaml.safe_dump(course_of(source, FLIGHTS[flight])))
        subprocess.run([apps / "trueline-simulate", f"--config={work}/course.yaml", "--seed=3",
                        f"--out={self.log}", f"--duration={FLIGHTS[flight]['seconds']}",
                        "--quiet"], check=True)

    @cached_property
    def calibration(self):
        """Of the untouched log."""
        calibration = self.result("calibrate", self.log, self.work / "untouched_calibration")
        assert self.tiny or calibration["verdict"] == "usable", "nothing can be silently wrong"
        return calibration

    @cached_property
    def causes(self):
        return causes(self.result("diagnose", self.log, self.work / "untouched_diagnosis"))

    def run(self, verb, *flags):
        return run_verb([self.apps / f"trueline-{verb}", *flags], self.cpu_seconds, self.memory)

    def result(self, verb, log, out):
        """The YAML of a run that must succeed."""
        outcome = self.run(verb, *arguments_of(verb, log, out))
        assert outcome.code == 0, outcome.err
        return read_result(verb, out)


def course_of(source, flight):
    course = yaml.safe_load((source / "config/simulate/hippodrome.yaml").read_text())
    course["imu"]["rate"], course["mocap"]["rate"] = flight["imu"], flight["mocap"]
    course["course"]["speed"] = flight["speed"]
    course["course"]["radius"] *= flight["size"]
    for corner in course["course"]["corners"]:
        corner["position"] = [flight["size"] * x for x in corner["position"]]
    return course


def arguments_of(verb, log, out):
    more = ["--gamma_sweep="] if verb == "calibrate" else []
    return [f"--log={log}", f"--out={out}", *FLAGS, *more]


def read_result(verb, out):
    name = {"calibrate": "calibration", "diagnose": "diagnosis"}[verb]
    return yaml.safe_load((out / f"{name}.yaml").read_text())


def causes(diagnosis):
    return {cause["id"] for cause in diagnosis.get("causes") or []}


def knock_native(base, folder, draw, diagnose, calibrated):
    """A mutation of one file; events of convert, inspect, calibrate and diagnose."""
    folder.mkdir(parents=True)
    files = sorted(base.log.iterdir())
    file = draw.choice(files)
    name, data = mutate(file.read_bytes(), draw, file.suffix == ".csv")
    for other in files:
        if other != file:
            os.symlink(other, folder / other.name)
    (folder / file.name).write_bytes(data)
    label = f"{name} of {file.name}"
    out = folder / "out"
    events = []
    if draw.random() < 0.3:
        flags = [f"--map={base.map}", f"--in={inputs_of(folder)}", f"--out={out}", "--quiet"]
        events.append(event(base, "convert", label, folder, flags, lambda: ""))
    if draw.random() < 0.3:
        events.append(event(base, "inspect", label, folder, arguments_of("inspect", folder, out),
                            lambda: ""))
    if draw.random() < calibrated:
        events.append(event(base, "calibrate", label, folder,
                            arguments_of("calibrate", folder, out),
                            lambda: wrong_calibration(base, read_result("calibrate", out))))
    if diagnose:
        events.append(event(base, "diagnose", label, folder, arguments_of("diagnose", folder, out),
                            lambda: wrong_diagnosis(base, read_result("diagnose", out))))
    return events


def knock_foreign(base, file, folder, draw):
    """Bytes of a real recording changed; convert alone."""
    folder.mkdir(parents=True)
    broken = folder / file.name
    name, data = mutate(file.read_bytes(), draw, False)
    broken.write_bytes(data)
    flags = [f"--in={broken}", f"--out={folder / 'out'}", "--quiet"]
    return [event(base, "convert", f"{name} of {file.name}", folder, flags, lambda: "")]


def event(base, verb, label, folder, flags, wrong):
    """Runs the verb; (verb, mutation, what came out, text)."""
    outcome = base.run(verb, *flags)
    if outcome.fault:
        keep(base, folder, verb)
        return verb, label, "fault", outcome.fault
    if outcome.code:
        return verb, label, {2: "refused", 3: "no result"}[outcome.code], ""
    text = wrong()
    if text:
        keep(base, folder, verb)
    return verb, label, "silently wrong" if text else "done", text


def keep(base, folder, verb):
    kept = base.work / "faults" / f"{folder.name}_{verb}"
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(folder, kept, ignore=shutil.ignore_patterns(".out*"))


def wrong_calibration(base, result):
    if result["verdict"] != "usable" or result["warnings"] or result["reasons"]:
        return ""
    for name, estimate in result["parameters"].items():
        if estimate["status"] != "identified" or name not in base.calibration["parameters"]:
            continue
        untouched = base.calibration["parameters"][name]["value"]
        off = abs(estimate["value"] - untouched)
        if not off <= WITHIN * estimate["sigma"]:
            return (f"{name} = {estimate['value']} +- {estimate['sigma']}, untouched "
                    f"{untouched}: {off / estimate['sigma']:.1f} sigmas")
    return ""


def wrong_diagnosis(base, result):
    new = causes(result) - base.causes
    if not new or result.get("warnings"):
        return ""
    return f"names {', '.join(sorted(new))}"
