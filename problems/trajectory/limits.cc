#include "problems/trajectory/limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

struct Extremes {
  Eigen::Vector3d lowest = Eigen::Vector3d::Constant(INFINITY);
  Eigen::Vector3d highest = Eigen::Vector3d::Constant(-INFINITY);
  double rate = 0.0, cos_tilt = 1.0, min_u = INFINITY, max_u = -INFINITY;
  double roll = 0.0, pitch = 0.0;  // rad

  void Add(const RotorFlight& flight, double t) {
    using Series = Taylor<double, 4>;
    const auto state =
        StateFromFlat<Series>(flight.vehicle(), FlatSeries<Series>(flight.path().Expand(t, 4)));
    for (int i = 0; i < 3; ++i) {
      lowest[i] = std::min(lowest[i], state.p[i][0]);
      highest[i] = std::max(highest[i], state.p[i][0]);
      rate = std::max(rate, std::abs(state.w[i][0]));
    }
    cos_tilt = std::min(cos_tilt, state.cos_tilt[0]);
    const DownInBody<double> down = DownInBodyOf<double>(state);
    roll = std::max(roll, std::abs(std::atan2(down.y, down.z)));
    pitch = std::max(pitch, std::asin(std::min(1.0, std::abs(down.x))));
    for (const Series& u : state.u) {
      min_u = std::min(min_u, u[0]);
      max_u = std::max(max_u, u[0]);
    }
  }
};

LimitUse UseOf(const Extremes& extremes, const FlightLimits& limits) {
  LimitUse use;
  use.travel = (extremes.highest - extremes.lowest).maxCoeff();
  use.rate = extremes.rate;
  use.tilt = std::acos(std::clamp(extremes.cos_tilt, -1.0, 1.0));
  // A negative square means negative thrust: infeasible at any speed.
  use.min_speed = extremes.min_u > 0.0 ? std::sqrt(extremes.min_u) : 0.0;
  use.max_speed = std::sqrt(std::max(extremes.max_u, 0.0));
  use.roll = extremes.roll;
  use.pitch = extremes.pitch;
  const std::pair<const char*, double> shares[] = {
      {"travel", use.travel / limits.travel},
      {"rate", use.rate / limits.rate},
      {"tilt", use.tilt / limits.tilt},
      {"min_speed", use.min_speed > 0.0 ? limits.min_speed / use.min_speed : INFINITY},
      {"max_speed", use.max_speed / limits.max_speed},
      {"roll", use.roll / limits.roll},
      {"pitch", use.pitch / limits.pitch}};
  for (const auto& [name, share] : shares) {
    if (!(share <= use.worst)) use.worst = share, use.binding = name;  // NaN counts as broken
  }
  return use;
}

// Times of a grid of at most `step` seconds, ends included.
std::vector<double> Grid(const PiecewisePolynomial& path, double step) {
  const int steps = std::max(1, static_cast<int>(std::ceil(path.duration() / step)));
  std::vector<double> times;
  for (int i = 0; i <= steps; ++i) times.push_back(path.start() + i * path.duration() / steps);
  return times;
}

// As CheckLimits(...).worst <= 1, but ends at the first time that breaks a limit.
bool HoldsLimits(const RotorFlight& flight, const FlightLimits& limits, double step) {
  constexpr std::size_t kStride = 16;  // so that all parts of the flight are looked at early
  const std::vector<double> times = Grid(flight.path(), step);
  Extremes extremes;
  for (std::size_t first = 0; first < kStride; ++first) {
    for (std::size_t i = first; i < times.size(); i += kStride) extremes.Add(flight, times[i]);
    if (!(UseOf(extremes, limits).worst <= 1.0)) return false;
  }
  return true;
}

}  // namespace

LimitUse CheckLimits(const RotorFlight& flight, const FlightLimits& limits, double step) {
  Extremes extremes;
  for (const double t : Grid(flight.path(), step)) extremes.Add(flight, t);
  return UseOf(extremes, limits);
}

std::string LimitWarning(const std::string& name, const RotorFlight& flight,
                         const FlightLimits& limits) {
  constexpr double kStep = 0.005;  // s
  const LimitUse use = CheckLimits(flight, limits, kStep);
  if (use.worst <= 1.0) return "";
  return fmt::format("{}: the trajectory breaks the limit on {} ({:.2f} times)", name, use.binding,
                     use.worst);
}

PiecewisePolynomial ScaledToLimits(const RotorVehicle& vehicle, const PiecewisePolynomial& path,
                                   const FlightLimits& limits, double step, double largest) {
  const auto holds = [&](double factor) {
    return HoldsLimits(RotorFlight(vehicle, path.Scaled(factor)), limits, step);
  };
  if (!holds(0.0)) {
    throw InputError(
        "the vehicle can't hover within the limits; raise max_speed, lower min_speed "
        "or check mass and k_f");
  }
  if (holds(largest)) return path.Scaled(largest);
  double low = 0.0, high = largest;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return path.Scaled(low);
}

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
