// The rank of a system at random points.
#pragma once

#include <cmath>
#include <vector>

#include "problems/observability/lie_derivatives.h"
#include "problems/observability/rank.h"

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

}  // namespace trueline
