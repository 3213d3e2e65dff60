#include "problems/observability/rotor_driven_rank.h"

#include "problems/observability/generic_rank.h"

namespace trueline {

RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed) {
  constexpr int kOrder = 12;
  using ExactPoints = RotorDrivenPoints<Modular, RotorDrivenSystem::kErrors>;
  using NearPoints = RotorDrivenPoints<double, kOrder>;
  const std::vector<double> none(RotorDrivenSystem::kStates, 0.0);
  const auto exact = [&](int order, int k) {
    return ExactPoints(system.model(), none, 2 * seed + k).Draw(motion, order);
  };
  return GenericRank(system, states, exact,
                     NearPoints(system.model(), nominal, seed).Draw(motion, kOrder),
                     NearPoints::kTimeScale);
}

}  // namespace trueline
