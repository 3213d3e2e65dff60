// Limits of a flight (Boehm et al. 2020, sec. II-D), checked on a grid of times.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

struct FlightLimits {
  double travel = 1.0;                    // m, between the extremes of each axis
  double rate = 6.283185307179586;        // rad/s, about each body axis
  double tilt = 1.2217304763960306;       // rad (70 deg), of body z from down
  double min_speed = 575.9586531581287;   // rad/s (5,500 rpm), of each rotor
  double max_speed = 1717.4039839805991;  // rad/s (16,400 rpm)
  // rad, of the Euler angles (z, y, x), as Boehm et al. have them; infinite: no such limit.
  double roll = std::numeric_limits<double>::infinity();
  double pitch = std::numeric_limits<double>::infinity();
};

// Use of the limits by one flight: extremes over the grid.
struct LimitUse {
  double travel = 0.0, rate = 0.0, tilt = 0.0, min_speed = 0.0, max_speed = 0.0;
  double roll = 0.0, pitch = 0.0;
  double worst = 0.0;   // largest use as a share of its limit; at most 1 where all limits hold
  std::string binding;  // the limit that this is
};

// Steps of at most `step` seconds, ends included.
LimitUse CheckLimits(const RotorFlight& flight, const FlightLimits& limits, double step);

// Says which limit the flight `name` breaks most; empty where it keeps all.
std::string LimitWarning(const std::string& name, const RotorFlight& flight,
                         const FlightLimits& limits);

// The trajectory scaled about its start by the largest factor up to `largest` that keeps the limits
// on the grid, found by bisection; a small enough factor always does, because hover keeps them.
PiecewisePolynomial ScaledToLimits(const RotorVehicle& vehicle, const PiecewisePolynomial& path,
                                   const FlightLimits& limits, double step, double largest);

// Random flights as large as a vehicle's limits allow.

PiecewisePolynomial SplinePath(const SplineShape& shape, const FlatMatrix& free);

// Free control points, scaled so that the flight fills its limits.
FlatMatrix FilledToLimits(const RotorVehicle& vehicle, const SplineShape& shape,
                          const FlightLimits& limits, const FlatMatrix& free);

// Free control points of a random flight that fills its limits.
FlatMatrix RandomFeasibleControl(const RotorVehicle& vehicle, const SplineShape& shape,
                                 const FlightLimits& limits, Random* random);

// A random flight of the shape, as large as the limits allow. With a seed: of two pieces a second.
PiecewisePolynomial RandomFeasibleFlight(const RotorVehicle& vehicle, const SplineShape& shape,
                                         const FlightLimits& limits, Random* random);
PiecewisePolynomial RandomFeasibleFlight(const RotorVehicle& vehicle, double duration,
                                         const FlightLimits& limits, std::uint64_t seed);

}  // namespace trueline
