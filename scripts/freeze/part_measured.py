"""Measured flights: diagnoses and calibrations of both drives, and the estimators side by side."""
from concurrent.futures import ThreadPoolExecutor

import yaml

from flights import CALIBRATE_BY, FLIGHTS, IMU, ROTOR_DIAGNOSES, ROTORS, ROTORS_WITH_MODEL
from program import SOURCE, app, convert_once, read_yaml, run_once
from records import (benchmark_records, calibration_record, diagnosis_record,
                     rotor_calibration_record)

SEEDS = 5  # of the fixes in the table of estimators


def convert(arguments, name):
    map_name, files = FLIGHTS[name]
    out = arguments.work / "logs" / name
    convert_once(arguments, map_name, [arguments.data / file for file in files], out)


def logs(arguments, names):
    return "--log=" + ",".join(str(arguments.work / "logs" / name) for name in names)


def config(name):
    return f"--config={SOURCE}/config/calibrate/{name}.yaml"


def execute(arguments, folder, verb, *flags):
    return run_once(arguments, [app(arguments, verb), f"--out={folder}", "--report=false", "--quiet",
                                *flags], folder)


def record_of(folder, exit_code, read):
    """What a command decided; its exit code alone where it gave nothing."""
    try:
        return {"exit": exit_code, **read(folder)}
    except FileNotFoundError:
        return {"exit": exit_code}


def read_diagnosis(folder):
    return diagnosis_record(read_yaml(folder / "diagnosis.yaml"))


def diagnose_imu(arguments, name, fit_to):
    folder = arguments.work / "measured_imu" / f"{name}_{fit_to}"
    code = execute(arguments, folder, "diagnose", logs(arguments, [name, *IMU[name]]),
                   f"--fit_to={fit_to}")
    return f"{name}, {fit_to}", record_of(folder, code, read_diagnosis)


def calibrate_imu(arguments, name):
    folder = arguments.work / "measured_imu" / f"{name}_calibration"
    code = execute(arguments, folder, "calibrate", logs(arguments, [name]), "--gamma_sweep=",
                   "--estimator=smoother,vgd", config(CALIBRATE_BY.get(name, "default")))
    return f"{name}, calibration", record_of(folder, code, calibration_record)


def estimators(arguments):
    """README's table of estimators, with fewer seeds."""
    folder = arguments.work / "measured_imu" / "estimators"
    folder.mkdir(parents=True, exist_ok=True)
    text = (SOURCE / "config/experiments/real_flights.yaml").read_text()
    experiment = yaml.safe_load(text.replace("../", f"{SOURCE}/config/"))
    experiment["seeds"]["count"] = SEEDS
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment))
    execute(arguments, folder, "benchmark", f"--config={folder}/experiment.yaml",
            f"--threads={arguments.jobs}")
    return benchmark_records(read_yaml(folder / "summary.yaml"))


def calibrate_rotors(arguments, name, model=None):
    folder = arguments.work / "measured_rotors" / f"{name}_calibration{'_with_model' * bool(model)}"
    flags = [f"--model={arguments.work}/measured_rotors/{model}/model.yaml"] if model else []
    code = execute(arguments, folder, "calibrate", "--drive=rotors", logs(arguments, [name]),
                   config(ROTORS[name]), *flags)
    what = f"{name}, calibration" + (f" with what {model} found" if model else "")
    return what, record_of(folder, code, rotor_calibration_record)


def diagnose_rotors(arguments, name):
    folder = arguments.work / "measured_rotors" / name
    code = execute(arguments, folder, "diagnose", "--drive=rotors", config(ROTORS[name]),
                   logs(arguments, [name, *ROTOR_DIAGNOSES[name]]))
    return f"{name}, diagnosis", record_of(folder, code, read_diagnosis)


def run_all(arguments, tasks):
    with ThreadPoolExecutor(arguments.jobs) as pool:
        return dict(pool.map(lambda task: task[0](arguments, *task[1:]), tasks))


def convert_all(arguments, names):
    with ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(lambda name: convert(arguments, name), names))


def run_imu(arguments):
    convert_all(arguments, IMU)
    tasks = [(diagnose_imu, name, fit_to) for name in IMU for fit_to in ("mocap", "fixes")]
    tasks += [(calibrate_imu, name) for name in IMU]
    return {"flights": run_all(arguments, tasks), "estimators": estimators(arguments)}


def run_rotors(arguments):
    convert_all(arguments, ROTORS)
    tasks = [(calibrate_rotors, name) for name in ROTORS]
    tasks += [(diagnose_rotors, name) for name in ROTOR_DIAGNOSES]
    records = run_all(arguments, tasks)
    with_model = [(calibrate_rotors, name, model) for name, model in ROTORS_WITH_MODEL.items()]
    return {"flights": {**records, **run_all(arguments, with_model)}}
