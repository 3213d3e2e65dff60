// The rank of a system at random points.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "problems/observability/imu_driven_system.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/observability/rank.h"
#include "problems/observability/rotor_driven_points.h"

namespace trueline {

// Rank and null space for `states`. The rank is the larger one at two points of GF(p), exact(order,
// k) for k = 0 and 1; null vectors are in physical units at `near`, whose inputs vary within
// `time_scale` seconds. n derivatives suffice for n unknowns (Sedoglavic 2002).
template <class System, class ExactPoint, int kOrder>
RankReport GenericRank(const System& system, const std::vector<int>& states,
                       const ExactPoint& exact, const SystemPoint<double, kOrder>& near,
                       double time_scale) {
  const auto rank = [&](int k) {
    const int order = static_cast<int>(states.size());
    const auto point = exact(order, k);
    return ExactRank(ObservabilityMatrix<System::kErrors, Modular>(system, point.x, point.u, order),
                     states);
  };
  RankReport report = rank(0);
  const RankReport again = rank(1);
  if (again.rank > report.rank) report = again;
  Eigen::MatrixXd matrix = ObservabilityMatrix<kOrder, double>(system, near.x, near.u, kOrder);
  const Eigen::Index outputs = system.num_outputs();
  for (int i = 0; i <= kOrder; ++i) {
    matrix.middleRows(i * outputs, outputs) *= std::pow(time_scale, i);
  }
  FillDirections(matrix, system.errors(), &report);
  return report;
}

// The exact observability of the model of Li et al. 2019: which of its nine parameters are
// observable from position fixes.

// The vehicle's rotation during the flight.
enum class Turning {
  kAny,    // roll, pitch and yaw vary
  kNoYaw,  // roll and pitch vary, heading does not
  kPitch,  // only pitch varies: straight ahead and back
  kNone    // attitude is constant
};

// As RotorDrivenRank. Thrust varies except for kNone, where it is constant.
RankReport ImuDrivenRank(const ImuDrivenSystem& system, const std::vector<int>& states,
                         Turning turning, std::uint64_t seed = 0);

// The exact observability of the rotor-driven model (Boehm et al. 2020, table I).

// Rank and null space for `states` (error states; all others are known), with null vectors in
// physical units at a point near `nominal` (kStates numbers). The rank is the larger one of two
// random points; it is wrong with a probability below 1e-14. Throws InputError if the vehicle
// cannot fly the motion.
RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed = 0);

}  // namespace trueline
