#!/usr/bin/env python3
"""Coverage of stated uncertainties over simulated flights: simulation-based calibration.

Flies a configuration with parameters drawn by seed, calibrates each flight with the smoother, and
tells where the simulator's truth lies in the stated distribution of each parameter, of the last
window and of the whole flight: how often the 95 % and 50 % intervals hold it, and whether its ranks
(the stated distribution function at the truth) are uniform: the largest distance of their empirical
distribution from it, beside the distance that 95 % of uniform samples stay below.

  scripts/coverage.py --build=build --config=config/simulate/long_flight.yaml --duration=60 \\
      --flights=500 --out=/tmp/coverage
  scripts/coverage.py --config=config/simulate/hippodrome.yaml --set=ahrs.tilt_gain=0.02 ...
  scripts/coverage.py --suite --flights=125 --out=/tmp/suite

prints a table and writes OUT/coverage.yaml. `--suite` does so for eight kinds of flights: fig. 3's
attitude filter at four gains, a drifting and a constant attitude error, fast laps and a figure of
eight, with parameters and strengths of noise drawn from the estimator's prior. `--strengths=stated`
keeps the noise that each configuration states. Flights that are there already are not flown
again, so an interrupted run goes on where it stopped. `--calibrate` is a YAML file with options.
"""
import argparse
import hashlib
import math
import pathlib
import random
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import yaml

SOURCE = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCE / "scripts/freeze"))
from program import clear_left_over, refuse_other_draw, refuse_other_program

NAMES = ["K_x", "K_y", "b_ax", "b_ay", "b_az", "phi_E_Ep", "theta_E_Ep", "psi_E_Ep", "phi_I_B",
         "theta_I_B", "psi_I_B"]


HIPPODROME = "config/simulate/hippodrome.yaml"
SUITE = {  # configuration, what differs
    "hippodrome, gain 0.005": (HIPPODROME, ["ahrs.tilt_gain=0.005", "ahrs.integral_gain=0"]),
    "hippodrome, gain 0.02": (HIPPODROME, ["ahrs.tilt_gain=0.02", "ahrs.integral_gain=0.0001"]),
    "hippodrome, gain 0.05": (HIPPODROME, []),
    "hippodrome, gain 0.1": (HIPPODROME, ["ahrs.tilt_gain=0.1", "ahrs.integral_gain=0.005"]),
    "long flight, drifting": ("config/simulate/long_flight.yaml", []),
    "long flight, constant": ("config/simulate/long_flight.yaml",
                              ["ahrs.drift_sigma=[0.0001, 0.0001, 0.0001]"]),
    "fast": ("config/simulate/fast.yaml", []),
    "figure of eight": ("config/simulate/figure_eight.yaml", []),
}
# Truth is drawn from the estimator's own prior, else ranks can't be uniform (Talts et al. 2018):
# normal, with mean and deviation of these ranges (Table 2). Drag that drives the vehicle on is drawn
# again.
PRIOR = {"K_x": [-1.0, 0.0], "K_y": [-1.0, 0.0], "b_ax": [-0.3, 0.3], "b_ay": [-0.3, 0.3],
         "b_az": [-1.0, 1.0], "phi_I_B": [-0.052, 0.052], "theta_I_B": [-0.052, 0.052],
         "psi_I_B": [-0.052, 0.052], "heading_error": [-0.052, 0.052]}
# The AHRS's constant error, where it is no outcome of a filter.
PRIOR_OF_AHRS = {name: [-0.052, 0.052] for name in ("phi_E_Ep", "theta_E_Ep", "psi_E_Ep")}
# Medians of the strengths of noise, as config/calibrate/default.yaml has them; their prior is
# log-normal with a factor of three.
ACCELERATION = 0.05  # m/s^2/sqrt(Hz)
GUST = 0.06  # m/s^2
TILT = 0.026  # rad
# The attitude's error changes over a flight; its truth is known as the flight's mean alone.
VARIES = ("phi_E_Ep", "theta_E_Ep", "psi_E_Ep")


def by_prior(seed, filtered):
    """`randomise` of one flight: ranges of no width."""
    draw = random.Random(seed)
    drawn = {}
    prior = dict(PRIOR, **({} if filtered else PRIOR_OF_AHRS))
    for name, (low, high) in prior.items():
        if name == "heading_error" and not filtered:
            continue
        value = None
        while value is None or (name.startswith("K_") and value > -0.02):
            value = draw.gauss((low + high) / 2.0, (high - low) / math.sqrt(12.0))
        drawn[name] = [value, value]
    return drawn


def draw_strengths(values, seed):
    """Noise of the accelerometer, gusts and a drift of the attitude within seconds, by the prior."""
    draw = random.Random(f"strengths {seed}")
    acceleration, gust, tilt = (median * 3.0 ** draw.gauss(0.0, 1.0)
                                for median in (ACCELERATION, GUST, TILT))
    values["imu"]["accel_noise_density"] = acceleration
    values["turbulence"] = {"sigma": [gust, gust, gust], "memory": 0.8}
    ahrs = values.get("ahrs", {})
    if "drift_sigma" in ahrs and ahrs["drift_memory"] == 1.0:
        ahrs["drift_sigma"] = [tilt, tilt, ahrs["drift_sigma"][2]]


def configured(config, duration, changes, seed, strengths, file):
    """Writes the configuration with another duration and changes.

    seed: of parameters by the prior, or None. strengths: true if those of noise are drawn, too.
    """
    values = yaml.safe_load((SOURCE / config).read_text())
    values["duration"] = duration
    if seed is not None:
        kind = values.get("ahrs", {}).get("kind", "complementary_filter")
        values["randomise"] = by_prior(seed, kind == "complementary_filter")
        if strengths:
            draw_strengths(values, seed)
    for change in changes:
        key, value = change.split("=", 1)
        *folders, name = key.split(".")
        place = values
        for folder in folders:
            place = place[folder]
        place[name] = yaml.safe_load(value)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(yaml.safe_dump(values))
    return file


def fly(arguments, config, changes, seed, out):
    """One flight's (truth, {"whole": estimates, "window": estimates}), all by name."""
    folder = out / f"flight_{seed:04d}"
    result = folder / "result" / "calibration.yaml"
    if not result.exists():
        log = folder / "log"
        clear_left_over(log)
        config = configured(config, arguments.duration, changes, seed if arguments.suite else None,
                            arguments.strengths == "drawn", folder.with_suffix(".yaml"))
        apps = arguments.build / "apps"
        subprocess.run([apps / "trueline-simulate", f"--config={config}", f"--out={log}",
                        f"--seed={seed}", "--randomise", "--quiet"], check=True)
        command = [apps / "trueline-calibrate", f"--log={log}", f"--out={folder / 'result'}",
                   "--estimator=smoother", "--gamma_sweep=", "--report=false", "--quiet"]
        if arguments.calibrate:
            command.append(f"--config={arguments.calibrate}")
        unusable = 3
        if subprocess.run(command, check=False).returncode not in (0, unusable):
            raise RuntimeError(f"failed: {' '.join(map(str, command))}")
        for stream in log.glob("*"):  # the log is as large as an hour of IMU; its truth stays
            stream.unlink()
    truth = yaml.safe_load((folder / "log.truth.yaml").read_text())
    true = {name: entry["value"] for name, entry in truth["parameters"].items()}
    true["b_ax"], true["b_ay"] = truth["imu"]["accel_bias"][:2]
    found = yaml.safe_load(result.read_text())
    whole = found.get("whole_flight") or {}  # an unusable flight may have none
    return true, {"whole": whole.get("parameters") or {}, "window": found.get("parameters") or {}}


def worst_distance(z):
    """Of the ranks' empirical distribution from the uniform one, and the 95 % band of that."""
    ranks = sorted(0.5 * math.erfc(-value / math.sqrt(2.0)) for value in z)
    n = len(ranks)
    distance = max(max((i + 1) / n - u, u - i / n) for i, u in enumerate(ranks))
    return distance, 1.358 / (math.sqrt(n) + 0.12 + 0.11 / math.sqrt(n))


def summarise(flights, of):
    """By parameter: flights, shares inside, mean error in sigmas and their spread, ranks."""
    rows = {}
    for name in NAMES:
        if of == "window" and name in VARIES:
            continue
        z = [(found[of][name]["value"] - true[name]) / found[of][name]["sigma"]
             for true, found in flights if name in found[of]]
        if not z:
            continue
        distance, band = worst_distance(z)
        rows[name] = {"flights": len(z),
                      "inside_95": sum(abs(value) <= 1.96 for value in z) / len(z),
                      "inside_50": sum(abs(value) <= 0.6745 for value in z) / len(z),
                      "mean_in_sigmas": sum(z) / len(z),
                      "rms_in_sigmas": math.sqrt(sum(value * value for value in z) / len(z)),
                      "rank_distance": distance, "rank_band_95": band}
    return rows


def run(arguments, config, changes, out, kind=0):
    """Flights of one kind; those of another kind have other seeds, so that all are independent."""
    out.mkdir(parents=True, exist_ok=True)
    first = arguments.first_seed + 1000 * kind
    with ThreadPoolExecutor(arguments.jobs) as pool:
        return list(pool.map(
            lambda seed: fly(arguments, config, changes, seed, out),
            range(first, first + arguments.flights)))


def report(flights, title, out):
    """Prints the tables; writes those of the whole flight and of windows."""
    rows = {of: summarise(flights, of) for of in ("whole", "window")}
    (out / "coverage.yaml").write_text(yaml.safe_dump(rows["whole"]))
    (out / "coverage_windows.yaml").write_text(yaml.safe_dump(rows["window"]))
    for of, table in rows.items():
        print(f"{title}, {of}\n{'parameter':<12}{'flights':>8}{'in 95 %':>9}{'in 50 %':>9}"
              f"{'mean':>8}{'rms':>8}{'ranks off':>11}  (mean, rms in sigmas)")
        for name, row in table.items():
            uniform = "" if row["rank_distance"] <= row["rank_band_95"] else " beyond the band"
            print(f"{name:<12}{row['flights']:>8}{100 * row['inside_95']:>8.1f}%"
                  f"{100 * row['inside_50']:>8.1f}%{row['mean_in_sigmas']:>8.2f}"
                  f"{row['rms_in_sigmas']:>8.2f}{row['rank_distance']:>11.3f}{uniform}", flush=True)


def what_decides(arguments):
    """What the flights of a folder depend on beside the program and their number."""
    stated = {name: getattr(arguments, name) for name in ("suite", "set", "duration", "strengths")}
    for name in ("calibrate", "config"):
        file = getattr(arguments, name)
        stated[name] = [file, sha256(SOURCE / file if name == "config" else file)] if file else None
    return stated


def sha256(file):
    return hashlib.sha256(pathlib.Path(file).read_bytes()).hexdigest()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build", type=pathlib.Path)
    parser.add_argument("--config", default="config/simulate/long_flight.yaml")
    parser.add_argument("--set", action="append", default=[], help="KEY.KEY=VALUE of the config")
    parser.add_argument("--suite", action="store_true", help="all kinds of flights")
    parser.add_argument("--only", default="", help="of the suite: kinds whose name has this in it")
    parser.add_argument("--strengths", choices=("drawn", "stated"), default="drawn",
                        help="of the suite's noise: drawn by the prior, or as configured")
    parser.add_argument("--calibrate", default="")
    parser.add_argument("--duration", default=60.0, type=float, help="s")
    parser.add_argument("--flights", default=500, type=int, help="of each kind")
    parser.add_argument("--first_seed", default=1, type=int)
    parser.add_argument("--jobs", default=1, type=int, help="flights at a time")
    parser.add_argument("--out", dest="work", metavar="OUT", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    refuse_other_draw(arguments.work, what_decides(arguments))
    if not arguments.suite:
        flights = run(arguments, arguments.config, arguments.set, arguments.work)
        report(flights, pathlib.Path(arguments.config).stem, arguments.work)
        return
    every = []
    for kind, (name, (config, changes)) in enumerate(SUITE.items()):
        if arguments.only not in name:
            continue
        out = arguments.work / name.replace(",", "").replace(" ", "_")
        flights = run(arguments, config, changes, out, kind)
        report(flights, name, out)
        every += flights
    report(every, "all", arguments.work)


if __name__ == "__main__":
    main()
