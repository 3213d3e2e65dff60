"""What is run: both blind sets, the measured flights, the coverage and the speeds."""
import json
import sys
from concurrent.futures import ThreadPoolExecutor

import yaml

from flights import CALIBRATE_BY, FLIGHTS, IMU, ROTOR_DIAGNOSES, ROTORS, ROTORS_WITH_MODEL
from program import SOURCE, app, clear_left_over, convert_once, processor_seconds, read_yaml, run_once, run_script

SEED = 101  # of the blind sets; nothing was tuned on it
SEEDS = 5   # of the fixes in the table of estimators
BENCHES = {"vgd_bench": "BarePass", "ekf_bench": "Propagate/dense",
           "observability_bench": "ExactGramianOf20s/step_ms:10"}
# Name: drive, configuration, seconds of flight, effect that is hidden.
DIAGNOSES = {
    "imu_clean": ("imu", "simulate/fast", 100, []),
    "imu_wind": ("imu", "simulate/fast", 100, [{"id": "wind", "w_x": 2.0, "w_y": 1.0}]),
    "rotors_clean": ("rotors", "rotors/random", 20, []),
    "rotors_weak": ("rotors", "rotors/random", 20, [{"id": "rotor_loss", "rotor": 1, "factor": 0.8}]),
}
LENGTHS = ["100", "1000", "3600"]  # s


def in_parallel(arguments, call, items):
    with ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(call, items))


def script(arguments, name, *flags):
    run_script(arguments, [sys.executable, SOURCE / "scripts" / name, f"--build={arguments.build}",
                           f"--flights={arguments.flights}", f"--jobs={arguments.jobs}", *flags])


def blind(arguments, drive):
    script(arguments, "blind/run.py", f"--drive={drive}", f"--work={arguments.work}/blind_{drive}", f"--seed={SEED}")


def coverage(arguments):
    script(arguments, "coverage.py", f"--out={arguments.work}/coverage")


def logs(arguments, *names):
    return "--log=" + ",".join(str(arguments.work / "logs" / name) for name in names)


def config(name):
    return f"--config={SOURCE}/config/calibrate/{name}.yaml"


def convert(arguments, name):
    map_name, files = FLIGHTS[name]
    convert_once(arguments, map_name, [arguments.data / file for file in files], arguments.work / "logs" / name)


def measured(arguments, names, tasks):
    """`tasks`: (folder, verb, flags...)."""
    def run(task):
        folder, verb, *flags = task
        run_once(arguments, [app(arguments, verb), f"--out={folder}", "--report=false", "--quiet", *flags], folder)
    in_parallel(arguments, lambda name: convert(arguments, name), names)
    in_parallel(arguments, run, tasks)


def measured_imu(arguments):
    folder = arguments.work / "measured_imu"
    experiment = yaml.safe_load((SOURCE / "config/experiments/real_flights.yaml").read_text().replace(
        "../", f"{SOURCE}/config/"))
    experiment["seeds"]["count"] = SEEDS
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment))
    measured(arguments, IMU, [
        *((folder / f"{name}_{fit}", "diagnose", logs(arguments, name, *IMU[name]), f"--fit_to={fit}")
          for name in IMU for fit in ("mocap", "fixes")),
        *((folder / f"{name}_calibration", "calibrate", logs(arguments, name), "--gamma_sweep=",
           "--estimator=smoother,vgd", config(CALIBRATE_BY.get(name, "default"))) for name in IMU)])
    measured(arguments, [], [(folder / "estimators", "benchmark", f"--config={folder}/experiment.yaml",
                              f"--threads={arguments.jobs}")])


def measured_rotors(arguments):
    folder = arguments.work / "measured_rotors"

    def rotors(verb, name, more=()):
        return verb, "--drive=rotors", config(ROTORS[name]), logs(arguments, name, *more)
    measured(arguments, ROTORS, [
        *((folder / f"{name}_calibration", *rotors("calibrate", name)) for name in ROTORS),
        *((folder / name, *rotors("diagnose", name, more)) for name, more in ROTOR_DIAGNOSES.items())])
    measured(arguments, [], [
        (folder / f"{name}_with_model", *rotors("calibrate", name), f"--model={folder}/{model}/model.yaml")
        for name, model in ROTORS_WITH_MODEL.items()])


def speed(arguments):
    """One by one: benchmarks as ratios to a reference of the same run, what a second of flight costs."""
    measures = {**{name: bench for name in BENCHES}, "scaling": scaling, **{name: diagnosis for name in DIAGNOSES}}
    for name, measure in measures.items():
        folder = arguments.work / "speed" / name
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "speed.yaml").exists():
            (folder / "speed.yaml").write_text(yaml.safe_dump(measure(arguments, name, folder)))


def bench(arguments, name, _):
    """Processor time of each benchmark over that of the reference."""
    text = run_script(arguments, [arguments.build / "tests" / name, "--benchmark_format=json",
                                  "--benchmark_repetitions=5", "--benchmark_min_time=0.2",
                                  "--benchmark_report_aggregates_only=true"])
    unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
    times = {row["run_name"]: row["cpu_time"] * unit[row["time_unit"]]
             for row in json.loads(text)["benchmarks"] if row["aggregate_name"] == "median"}
    return {what: time / times[BENCHES[name]] for what, time in times.items()}


def scaling(arguments, *_):
    """Processor seconds for a second of flight, and memory."""
    costs = {}
    text = run_script(arguments, [SOURCE / "scripts/scaling", f"--build={arguments.build}", *LENGTHS])
    for row in text.splitlines()[1:]:
        seconds, estimator, _, share, memory = row.split()
        costs[f"{estimator}, {seconds} s, cpu per flight second"] = float(share)
        costs[f"{estimator}, {seconds} s, MB"] = float(memory)
    return costs


def diagnosis(arguments, name, folder):
    drive, shipped, seconds, effects = DIAGNOSES[name]
    values = read_yaml(SOURCE / f"config/{shipped}.yaml")
    if "trajectory" in values:
        values["trajectory"]["duration"], values["simulation"]["effects"] = seconds, effects
    else:
        values |= {"duration": seconds, "effects": effects}
    (folder / "simulate.yaml").write_text(yaml.safe_dump(values))
    clear_left_over(folder / "log")
    run_script(arguments, [app(arguments, "simulate"), f"--config={folder}/simulate.yaml", f"--out={folder}/log",
                           "--seed=1", "--quiet"])
    flags = [config("rotors")] if drive == "rotors" else []
    spent = processor_seconds(arguments, [app(arguments, "diagnose"), f"--log={folder}/log", f"--out={folder}/result",
                                          f"--drive={drive}", "--report=false", "--quiet", *flags])
    return {"cpu per flight second": spent / seconds}


PARTS = {"blind_imu": lambda a: blind(a, "imu"), "blind_rotors": lambda a: blind(a, "rotors"),
         "measured_imu": measured_imu, "coverage": coverage, "measured_rotors": measured_rotors, "speed": speed}
