#include "problems/trajectory/feasible_flight.h"

namespace trueline {

PiecewisePolynomial SplinePath(const SplineShape& shape, const FlatMatrix& free) {
  return PiecewisePolynomial::FromSpline(RestToRest(shape, free), shape.degree, shape.duration);
}

FlatMatrix FilledToLimits(const RotorVehicle& vehicle, const SplineShape& shape,
                          const FlightLimits& limits, const FlatMatrix& free) {
  constexpr double kStep = 0.02;  // s
  const auto path = SplinePath(shape, free);
  const auto fitted = ScaledToLimits(vehicle, path, limits, kStep, 4.0);
  const int middle = fitted.num_pieces() / 2;
  const double norm = path.coefficients()[middle].norm();
  return norm > 0.0 ? FlatMatrix(free * (fitted.coefficients()[middle].norm() / norm)) : free;
}

FlatMatrix RandomFeasibleControl(const RotorVehicle& vehicle, const SplineShape& shape,
                                 const FlightLimits& limits, Random* random) {
  return FilledToLimits(vehicle, shape, limits,
                        RandomControl(shape, 0.5 * limits.travel, 1.5, random));
}

PiecewisePolynomial RandomFeasibleFlight(const RotorVehicle& vehicle, const SplineShape& shape,
                                         const FlightLimits& limits, Random* random) {
  return SplinePath(shape, RandomFeasibleControl(vehicle, shape, limits, random));
}

PiecewisePolynomial RandomFeasibleFlight(const RotorVehicle& vehicle, double duration,
                                         const FlightLimits& limits, std::uint64_t seed) {
  Random random(seed, "trajectory");
  return RandomFeasibleFlight(vehicle, SplineShape::Lasting(duration), limits, &random);
}

}  // namespace trueline
