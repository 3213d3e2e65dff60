"""A made-up native log and calibration result: an oval with two straights and known numbers."""
import math
from pathlib import Path

import numpy as np
import yaml

ESTIMATORS = ["vgd", "ekf"]
GAMMAS = [1, 2, 3]
ARCS = 8
STRAIGHT, RADIUS, SPEED = 3.0, 1.5, 1.8          # m, m, m/s
PASS_TIME, ARC_TIME = STRAIGHT / SPEED, math.pi * RADIUS / SPEED
PARAMETERS = {"K_x": (-0.55, 0.04, "1/s", "identified"), "K_y": (-0.50, 0.09, "1/s", "identified"),
              "b_az": (0.12, 0.03, "m/s^2", "weak"), "phi_E_Ep": (0.02, 0.004, "rad", "identified"),
              "psi_I_B": (0.3, 5.0, "rad", "unobservable"),
              "phi_I_B": (0.2, 0.01, "rad", "at_bound")}
HOSTILE = "<script>window.hacked = 1</script><b>&amp;"


def position(t):
    """(x, y) on the oval at time t, starting with the first straight; m, NED."""
    s = (t * SPEED) % (2 * STRAIGHT + 2 * math.pi * RADIUS)
    half = STRAIGHT + math.pi * RADIUS
    turn = 1.0 if s < half else -1.0
    s %= half
    if s < STRAIGHT:
        return turn * (s - STRAIGHT / 2), -turn * RADIUS
    angle = (s - STRAIGHT) / RADIUS
    return turn * (STRAIGHT / 2 + RADIUS * math.sin(angle)), -turn * RADIUS * math.cos(angle)


def write_csv(path, header, rows):
    lines = [header] + [",".join(f"{v:.6g}" if isinstance(v, float) else str(v) for v in row)
                        for row in rows]
    path.write_text("\n".join(lines) + "\n")


def write_log(directory, rng):
    directory.mkdir(parents=True)
    gates = [{"id": 0, "position": [3.0, -RADIUS, -1.5], "yaw": 0.0},
             {"id": 1, "position": [-3.0, RADIUS, -1.5], "yaw": math.pi}]
    (directory / "log.yaml").write_text(yaml.safe_dump(
        {"name": f"synthetic {HOSTILE}", "frame": "NED", "body": "FRD", "gates": gates}))
    duration = (ARCS + 1) * (PASS_TIME + ARC_TIME)
    write_csv(directory / "mocap.csv", "t [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]",
              [(float(t), *position(t), -1.5, 1, 0, 0, 0) for t in np.arange(0, duration, 1 / 120)])
    fixes = [(t, i, np.array(position(t)) + 0.15 * rng.standard_normal(2))
             for i in range(ARCS + 1)
             for t in (i * (PASS_TIME + ARC_TIME) + np.linspace(0, PASS_TIME, 18))]
    write_csv(directory / "fixes.csv", "t [s],x [m],y [m],z [m],sigma [m],gate [1]",
              [(float(t), *p, -1.5, 0.15, i % 2) for t, i, p in fixes])
    return fixes


def write_arcs(directory, rng):
    rows = []
    for estimator in ESTIMATORS:
        for gamma in GAMMAS:
            for tau in range(1, ARCS + 1):
                start = (tau - 1) * (PASS_TIME + ARC_TIME) + PASS_TIME
                truth = np.array(position(start + ARC_TIME - 1e-6))
                offset = rng.standard_normal(2) * 0.3 / gamma
                error = float(np.hypot(*offset))
                rows.append((
                    "log", estimator, gamma, tau, start, start + ARC_TIME,
                    "" if tau == 2 else error, 0.3 / gamma, 10 + tau, 0.012, "mocap",
                    "" if tau == 2 else int(error < 0.6 / gamma), *(truth + offset), *truth,
                    0.09 / gamma**2, 0.02 / gamma**2, 0.05 / gamma**2))
    write_csv(directory / "arcs.csv",
              "log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],"
              "predicted_sigma [m],iterations [1],solve_time [s],truth,inside_95 [1],"
              "x_predicted [m],y_predicted [m],x_truth [m],y_truth [m],cov_xx [m^2],cov_xy [m^2],"
              "cov_yy [m^2]", rows)


def write_trajectory(directory, rate):
    rows = []
    for estimator in ESTIMATORS:
        for tau in range(1, ARCS + 1):
            start = (tau - 1) * (PASS_TIME + ARC_TIME)
            for t in np.arange(start, start + PASS_TIME + ARC_TIME, 1 / rate):
                kind = "fit" if t < start + PASS_TIME else "prediction"
                drift = 0.1 * max(0.0, t - start - PASS_TIME)
                x, y = position(t)
                rows.append((float(t), estimator, kind, tau, x + drift, y - drift, -1.5,
                             SPEED, 0.0, 0.0))
    write_csv(directory / "trajectory.csv",
              "t [s],estimator,kind,tau,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]", rows)


def write_windows(directory, rng):
    rows = []
    for estimator in ESTIMATORS:
        for tau in range(1, ARCS + 1):
            end = (tau - 1) * (PASS_TIME + ARC_TIME) + PASS_TIME
            for name, (value, sigma, unit, status) in PARAMETERS.items():
                noise = min(sigma, 0.1) * float(rng.standard_normal())
                rows.append(("log", estimator, 3, tau, max(0.0, end - 9), end, name, value + noise,
                             sigma, unit, status))
    write_csv(directory / "windows.csv", "log,estimator,gamma,tau,t_start [s],t_end [s],"
              "parameter,value,sigma,unit,status", rows)


def write_residuals(directory, fixes):
    """Every fix in the window of its pass and in the next one, as overlapping windows have it."""
    rows = []
    for estimator in ESTIMATORS:
        for t, i, p in fixes:
            for tau in (i + 1, i + 2):
                r = p - np.array(position(t))
                rows.append(("log", estimator, 3, tau, float(t), i % 2, *r, "", 0.15, 1.0))
    write_csv(directory / "residuals.csv", "log,estimator,gamma,tau,t [s],gate [1],r_x [m],r_y [m],"
              "r_z [m],sigma [m],weight [1]", rows)


def write_summary(directory):
    parameters = {name: dict(zip(("value", "sigma", "unit", "status"), entry))
                  for name, entry in PARAMETERS.items()}
    (directory / "calibration.yaml").write_text(yaml.safe_dump({
        "verdict": "poor", "reasons": [f"one angle is at its bound {HOSTILE}"],
        "warnings": ["imu.csv: gap of 0.03 s at t = 12.5 s"], "estimator": "vgd", "gamma": 3,
        "parameters": parameters, "unobservable": ["psi_E_Ep +0.04 rad with psi_I_B -0.04 rad"],
        "whole_flight": {
            "flights": 2, "passes": 30, "duration": 120.5, "converged": True, "iterations": 4,
            "parameters": parameters, "unobservable": [],
            "notes": [f"K_y is not read from the accelerometer {HOSTILE}"],
            "strengths": {"tilt_drift": {"value": 0.0102, "interval95": [0.0075, 0.0139],
                                         "unit": "rad"}}},
        "arcs": {"count": ARCS, "inside_95_ellipse": 0.94,
                 "final_point_error": {"mean": 0.21, "median": 0.19, "p95": 0.4, "unit": "m"}},
        "provenance": {"version": "0.1.0", "log": "log", "seed": 0,
                       "sha256": {"imu.csv": "ab" * 32}, "config": {"vgd": {"loss": "huber"}}}},
        sort_keys=False))


def write_all(root, rate=128):
    """root/log and root/result; rate (Hz) of the trajectory. Returns the two folders."""
    rng = np.random.default_rng(7)
    log, result = Path(root) / "log", Path(root) / "result"
    fixes = write_log(log, rng)
    result.mkdir()
    write_arcs(result, rng)
    write_trajectory(result, rate)
    write_windows(result, rng)
    write_residuals(result, fixes)
    write_summary(result)
    return log, result
