// Random flights as large as a vehicle's limits allow.
#pragma once

#include <cstdint>

#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"

namespace trueline {

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
