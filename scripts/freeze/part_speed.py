"""Speeds: benchmarks as ratios to a reference of the same run, what a second of flight costs."""
import json

import yaml

from program import SOURCE, app, clear_left_over, processor_seconds, read_yaml, run_script
from records import digits

BENCHES = {"vgd_bench": "BarePass", "ekf_bench": "Propagate/dense",
           "observability_bench": "ExactGramianOf20s/step_ms:10"}
# Name: drive, configuration, seconds of flight, effect that is hidden.
DIAGNOSES = {
    "imu, clean": ("imu", "simulate/fast", 100, []),
    "imu, wind": ("imu", "simulate/fast", 100, [{"id": "wind", "w_x": 2.0, "w_y": 1.0}]),
    "rotors, clean": ("rotors", "rotors/random", 20, []),
    "rotors, weak rotor": ("rotors", "rotors/random", 20,
                           [{"id": "rotor_loss", "rotor": 1, "factor": 0.8}]),
}
LENGTHS = ["100", "1000", "3600"]  # s


def run(arguments):
    folder = arguments.work / "speed"
    folder.mkdir(parents=True, exist_ok=True)
    speeds = {name: lambda name=name: bench(arguments, name) for name in BENCHES}
    speeds["scaling"] = lambda: scaling(arguments)
    speeds |= {name: lambda name=name: diagnosis(arguments, name, folder) for name in DIAGNOSES}
    return {"flights": {name: {"speeds": once(folder / f"{name}.yaml", measure)}
                        for name, measure in speeds.items()}}


def once(file, measure):
    if not file.exists():
        file.write_text(yaml.safe_dump(measure(), sort_keys=False))
    return read_yaml(file)


def bench(arguments, name):
    """Processor time of each benchmark over that of the reference."""
    text = run_script(arguments, [arguments.build / "tests" / name, "--benchmark_format=json",
                                  "--benchmark_repetitions=5", "--benchmark_min_time=0.2",
                                  "--benchmark_report_aggregates_only=true"])
    unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    times = {row["run_name"]: row["cpu_time"] * unit[row["time_unit"]]
             for row in json.loads(text)["benchmarks"] if row["aggregate_name"] == "median"}
    return {what: digits(time / times[BENCHES[name]], 4) for what, time in times.items()}


def scaling(arguments):
    """Processor seconds for a second of flight, and memory."""
    text = run_script(arguments, [SOURCE / "scripts/scaling", f"--build={arguments.build}", *LENGTHS])
    costs = {}
    for row in text.splitlines()[1:]:
        seconds, estimator, _, share, memory = row.split()
        costs[f"{estimator}, {seconds} s, cpu per flight second"] = float(share)
        costs[f"{estimator}, {seconds} s, MB"] = float(memory)
    return costs


def diagnosis(arguments, name, folder):
    drive, shipped, seconds, effects = DIAGNOSES[name]
    out = folder / name.replace(", ", "_").replace(" ", "_")
    file = configured(read_yaml(SOURCE / f"config/{shipped}.yaml"), seconds, effects, out)
    clear_left_over(out / "log")
    run_script(arguments, [app(arguments, "simulate"), f"--config={file}", f"--out={out}/log",
                           "--seed=1", "--quiet"])
    flags = [f"--config={SOURCE}/config/calibrate/rotors.yaml"] if drive == "rotors" else []
    spent = processor_seconds(arguments, [app(arguments, "diagnose"), f"--log={out}/log",
                                          f"--out={out}/result", f"--drive={drive}",
                                          "--report=false", "--quiet", *flags])
    return {"cpu per flight second": digits(spent / seconds, 4)}


def configured(values, seconds, effects, out):
    """A shipped configuration with another duration and effects, written to `out`."""
    if "trajectory" in values:
        values["trajectory"]["duration"] = seconds
        values["simulation"]["effects"] = effects
    else:
        values["duration"] = seconds
        values["effects"] = effects
    out.mkdir(parents=True, exist_ok=True)
    (out / "simulate.yaml").write_text(yaml.safe_dump(values))
    return out / "simulate.yaml"
