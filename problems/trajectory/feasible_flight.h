// Random flights as large as a vehicle's limits allow.
#pragma once

#include <vector>

#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"

namespace trueline {

PiecewisePolynomial SplinePath(const SplineShape& shape, const FlatMatrix& free);

// Free control points, scaled so that the flight fills its limits.
FlatMatrix FilledToLimits(const RotorDrivenModel& model, const std::vector<double>& parameters,
                          const SplineShape& shape, const FlightLimits& limits,
                          const FlatMatrix& free);

// Free control points of a random flight that fills its limits.
FlatMatrix RandomFeasibleControl(const RotorDrivenModel& model,
                                 const std::vector<double>& parameters, const SplineShape& shape,
                                 const FlightLimits& limits, Random* random);

// A random flight of the shape, as large as the limits allow.
PiecewisePolynomial RandomFeasibleFlight(const RotorDrivenModel& model,
                                         const std::vector<double>& parameters,
                                         const SplineShape& shape, const FlightLimits& limits,
                                         Random* random);

}  // namespace trueline
