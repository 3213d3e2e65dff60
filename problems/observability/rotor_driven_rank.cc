#include "problems/observability/rotor_driven_rank.h"

#include <cmath>

namespace trueline {
namespace {

// n derivatives suffice for n unknowns (Sedoglavic 2002).
constexpr int kRotorExactOrder = RotorDrivenSystem::kErrors;
constexpr int kRotorNumericalOrder = 12;

DynamicMatrix<Modular> ExactMatrix(const RotorDrivenSystem& system, Motion motion, int order,
                                   std::uint64_t seed) {
  RotorDrivenPoints<Modular, kRotorExactOrder> points(
      system.model(), std::vector<double>(RotorDrivenSystem::kStates, 0.0), seed);
  const auto point = points.Draw(motion, order);
  return ObservabilityMatrix<kRotorExactOrder, Modular>(system, point.x, point.u, order);
}

// Rows of several random points in doubles, stacked; orders scaled by the time scale.
Eigen::MatrixXd NumericalMatrix(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                                Motion motion, std::uint64_t seed) {
  using Points = RotorDrivenPoints<double, kRotorNumericalOrder>;
  Points points(system.model(), nominal, seed);
  const auto point = points.Draw(motion, kRotorNumericalOrder);
  Eigen::MatrixXd matrix = ObservabilityMatrix<kRotorNumericalOrder, double>(
      system, point.x, point.u, kRotorNumericalOrder);
  const Eigen::Index outputs = system.num_outputs();
  for (int i = 0; i <= kRotorNumericalOrder; ++i) {
    matrix.middleRows(i * outputs, outputs) *= std::pow(Points::kTimeScale, i);
  }
  return matrix;
}

}  // namespace

RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed) {
  const int order = static_cast<int>(states.size());
  RankReport report = ExactRank(ExactMatrix(system, motion, order, 2 * seed), states);
  const RankReport again = ExactRank(ExactMatrix(system, motion, order, 2 * seed + 1), states);
  if (again.rank > report.rank) report = again;
  FillDirections(NumericalMatrix(system, nominal, motion, seed), system.errors(), &report);
  return report;
}

}  // namespace trueline
