"""Parameters of many vehicles over time: what changes from flight to flight, drifts, stands out.

A flight's value is x_i +- sigma_i. Conditions differ from flight to flight by more than sigma_i
says; tau, one number a parameter for the whole fleet, is the scatter that is left. All tests use
sigma_i^2 + tau^2. They share one chance of a false alarm, divided by the number of tests.
"""
import numpy as np
import pandas as pd
from scipy import stats

FALSE_ALARM = 0.01   # of one vehicle or more, in a fleet without a defect
LEAST_FLIGHTS = 3    # of a vehicle, for scatter and drift
CAUSE_BY_CHANCE = 0.02  # of clean flights that a diagnosis gives a false cause


def flight_scatter(table):
    """tau: the median vehicle's scatter about its own mean is what sigma and tau explain. A vehicle
    that drifts does not move a median."""
    groups = [g for _, g in table.groupby("vehicle") if len(g) >= LEAST_FLIGHTS]

    def excess(tau):
        ratios = []
        for g in groups:
            weight = 1.0 / (g.sigma**2 + tau**2)
            mean = np.average(g.value, weights=weight)
            ratios.append(np.sum(weight * (g.value - mean)**2) / stats.chi2.median(len(g) - 1))
        return np.median(ratios) - 1.0
    if not groups or excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, 10.0 * max(float(table.value.std()), 1e-12)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def weighted_line(days, value, sigma):
    """(mean, its sigma, slope by day, its sigma); no slope (0, inf) where all dates are one."""
    weight = 1.0 / sigma**2
    mean, middle = np.average(value, weights=weight), np.average(days, weights=weight)
    spread = np.sum(weight * (days - middle)**2)
    mean_sigma = 1.0 / np.sqrt(weight.sum())
    if spread <= 0.0:
        return mean, mean_sigma, 0.0, np.inf
    return mean, mean_sigma, np.sum(weight * (days - middle) * value) / spread, 1.0 / np.sqrt(spread)


def vehicle_rows(table):
    """One row a vehicle of one parameter: mean, drift, and the flight farthest from the line."""
    tau, rows = flight_scatter(table), []
    for vehicle, g in table.groupby("vehicle"):
        sigma = np.sqrt(g.sigma.to_numpy()**2 + tau**2)
        days, value = g.days.to_numpy(), g.value.to_numpy()
        mean, mean_sigma, slope, slope_sigma = weighted_line(days, value, sigma)
        off = _off_the_others(value, sigma) if len(g) >= LEAST_FLIGHTS else np.zeros(len(g))
        rows.append({"vehicle": vehicle, "flights": len(g), "mean": mean, "sigma": mean_sigma,
                     "slope_by_day": slope, "slope_sigma": slope_sigma,
                     "drift_z": slope / slope_sigma if len(g) >= LEAST_FLIGHTS else 0.0,
                     "farthest": g.flight.iloc[int(np.argmax(np.abs(off)))],
                     "farthest_z": float(np.abs(off).max()), "tau": tau})
    return pd.DataFrame(rows)


def _off_the_others(value, sigma):
    """Each value against the weighted mean of the others, in sigmas."""
    weight = 1.0 / sigma**2
    others = weight.sum() - weight
    mean = (np.sum(weight * value) - weight * value) / others
    return (value - mean) / np.sqrt(sigma**2 + 1.0 / others)


def against_the_fleet(rows):
    """Each vehicle's mean against the others', in sigmas: their spread is by the median deviation."""
    middle = rows["mean"].median()
    spread = 1.4826 * (rows["mean"] - middle).abs().median()
    inflated = spread * (1.0 + 2.0 / max(1, len(rows)))  # a spread of few vehicles is uncertain
    return (rows["mean"] - middle) / np.sqrt(rows.sigma**2 + inflated**2)


def limit(tests):
    """Sigmas beyond which one of so many tests is no chance."""
    return float(stats.norm.isf(FALSE_ALARM / max(1, tests) / 2.0))


def cause_by_chance(named, flights, tests):
    """Whether a cause is named on so many of a vehicle's flights by chance."""
    return stats.binom.sf(named - 1, flights, CAUSE_BY_CHANCE) > FALSE_ALARM / max(1, tests)
