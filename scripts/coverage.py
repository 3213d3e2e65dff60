#!/usr/bin/env python3
"""Coverage of the batch smoother's 95 % intervals over simulated flights.

Flies a configuration with parameters drawn by seed, calibrates each flight with the smoother, and
counts how often the interval of each parameter (value +- 1.96 sigma) holds the simulator's truth:

  scripts/coverage.py --build=build --config=config/simulate/long_flight.yaml --duration=60 \\
      --flights=500 --out=/tmp/coverage

prints a table and writes OUT/coverage.yaml. Flights that are there already are not flown again, so
an interrupted run goes on where it stopped. `--calibrate` is a YAML file with options.
"""
import argparse
import math
import pathlib
import subprocess
from concurrent.futures import ThreadPoolExecutor

import yaml

SOURCE = pathlib.Path(__file__).resolve().parents[1]
NAMES = ["K_x", "K_y", "b_ax", "b_ay", "b_az", "phi_E_Ep", "theta_E_Ep", "psi_E_Ep", "phi_I_B",
         "theta_I_B", "psi_I_B"]


def configured(config, duration, out):
    """The configuration with another duration, beside the results."""
    values = yaml.safe_load(pathlib.Path(config).read_text())
    values["duration"] = duration
    path = out / "simulate.yaml"
    path.write_text(yaml.safe_dump(values))
    return path


def fly(apps, config, calibrate, seed, out):
    """One flight's (truth, estimates), both by name."""
    folder = out / f"flight_{seed:04d}"
    result = folder / "result" / "calibration.yaml"
    if not result.exists():
        log = folder / "log"
        subprocess.run([apps / "trueline-simulate", f"--config={config}", f"--out={log}",
                        f"--seed={seed}", "--randomise", "--quiet"], check=True)
        command = [apps / "trueline-calibrate", f"--log={log}", f"--out={folder / 'result'}",
                   "--estimator=smoother", "--gamma_sweep=", "--report=false", "--quiet"]
        if calibrate:
            command.append(f"--config={calibrate}")
        subprocess.run(command, check=True)
        for stream in log.glob("*"):  # the log is as large as an hour of IMU; its truth stays
            stream.unlink()
    truth = yaml.safe_load((folder / "log.truth.yaml").read_text())
    true = {name: entry["value"] for name, entry in truth["parameters"].items()}
    true["b_ax"], true["b_ay"] = truth["imu"]["accel_bias"][:2]
    found = yaml.safe_load(result.read_text())["whole_flight"]["parameters"]
    return true, found


def summarise(flights):
    """By parameter: flights, share inside, mean error in sigmas and their spread."""
    rows = {}
    for name in NAMES:
        z = [(found[name]["value"] - true[name]) / found[name]["sigma"]
             for true, found in flights if name in found]
        if not z:
            continue
        mean = sum(z) / len(z)
        rows[name] = {"flights": len(z),
                      "inside_95": sum(abs(value) <= 1.96 for value in z) / len(z),
                      "mean_in_sigmas": mean,
                      "rms_in_sigmas": math.sqrt(sum(value * value for value in z) / len(z))}
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", type=pathlib.Path)
    parser.add_argument("--config", default=SOURCE / "config/simulate/long_flight.yaml")
    parser.add_argument("--calibrate", default="")
    parser.add_argument("--duration", default=60.0, type=float, help="s")
    parser.add_argument("--flights", default=500, type=int)
    parser.add_argument("--jobs", default=1, type=int, help="flights at a time")
    parser.add_argument("--out", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    config = configured(arguments.config, arguments.duration, arguments.out)
    apps = arguments.build / "apps"
    with ThreadPoolExecutor(arguments.jobs) as pool:
        flights = list(pool.map(lambda seed: fly(apps, config, arguments.calibrate, seed, arguments.out),
                                range(1, arguments.flights + 1)))
    rows = summarise(flights)
    (arguments.out / "coverage.yaml").write_text(yaml.safe_dump(rows))
    print(f"{'parameter':<12}{'flights':>8}{'in 95 %':>9}{'mean':>8}{'rms':>8}  (in sigmas)")
    for name, row in rows.items():
        print(f"{name:<12}{row['flights']:>8}{100 * row['inside_95']:>8.1f}%"
              f"{row['mean_in_sigmas']:>8.2f}{row['rms_in_sigmas']:>8.2f}")


if __name__ == "__main__":
    main()
