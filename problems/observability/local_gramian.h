// The observability of one short stretch of time by a Taylor series (Boehm et al. 2020, eq. 2-4).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/observability/lie_derivatives.h"

namespace trueline {

// Nodes and weights on [0, 1], exact for polynomials of degree 2 n - 1.
struct Quadrature {
  std::vector<double> nodes, weights;
};
Quadrature GaussLegendre(int n);

template <class C, int kErrors>
struct LocalSensitivity {
  using Matrix = Eigen::Matrix<C, Eigen::Dynamic, kErrors>;
  std::vector<Matrix> gradients;  // coefficient i of K(t), num_outputs x kErrors, eq. 2
  Matrix transition;              // d(error at the end) / d(error at the start), kErrors x kErrors
};

// The value of a series at t.
template <class C, int kMaxOrder>
C Evaluate(const Taylor<C, kMaxOrder>& series, double t) {
  const C time = MakeScalar<C>(t);
  C sum = series[series.degree()];
  for (int i = series.degree() - 1; i >= 0; --i) sum = sum * time + series[i];
  return sum;
}

template <int kOrder, class C, class System>
LocalSensitivity<C, System::kErrors> ExpandSensitivity(const System& system,
                                                       const std::vector<C>& x0,
                                                       const std::vector<Taylor<C, kOrder>>& u,
                                                       double duration) {
  constexpr int kErrors = System::kErrors;
  const auto solution = SolveSeriesWithGradient<kOrder, C, System>(system, x0, u, kOrder);
  LocalSensitivity<C, kErrors> local;
  for (int i = 0; i <= kOrder; ++i) {
    typename LocalSensitivity<C, kErrors>::Matrix k(system.num_outputs(), kErrors);
    for (int row = 0; row < system.num_outputs(); ++row) {
      k.row(row) = solution.y[row][i].v.transpose();
    }
    local.gradients.push_back(std::move(k));
  }
  using Jet = ceres::Jet<C, kErrors>;
  std::vector<Jet> end;
  std::vector<C> x_end, dx(System::kStates), error(kErrors);
  for (const auto& series : solution.x) {
    end.push_back(series.degree() == 0 ? series[0] : Evaluate(series, duration));
    x_end.push_back(end.back().a);
  }
  local.transition.resize(kErrors, kErrors);
  for (int column = 0; column < kErrors; ++column) {
    for (int i = 0; i < System::kStates; ++i) dx[i] = end[i].v[column];
    system.Error(x_end.data(), dx.data(), error.data());
    for (int i = 0; i < kErrors; ++i) local.transition(i, column) = error[i];
  }
  return local;
}

// K at `t`, rows scaled by `weights`.
template <int kErrors>
typename LocalSensitivity<double, kErrors>::Matrix SensitivityAt(
    const LocalSensitivity<double, kErrors>& local, const std::vector<double>& weights, double t) {
  auto k = local.gradients.back();
  for (int i = static_cast<int>(local.gradients.size()) - 2; i >= 0; --i) {
    k = k * t + local.gradients[i];
  }
  return Eigen::Map<const Eigen::VectorXd>(weights.data(), weights.size()).asDiagonal() * k;
}

// Integral of K'K over the stretch (eq. 3), including all cross terms of the series. K is a
// polynomial, so Gauss' rule with order + 1 nodes is exact.
template <int kErrors>
Eigen::Matrix<double, kErrors, kErrors> LocalGramian(const LocalSensitivity<double, kErrors>& local,
                                                     const std::vector<double>& weights,
                                                     double duration) {
  Eigen::Matrix<double, kErrors, kErrors> gramian;
  gramian.setZero();
  const Quadrature rule = GaussLegendre(static_cast<int>(local.gradients.size()));
  for (std::size_t g = 0; g < rule.nodes.size(); ++g) {
    const auto k = SensitivityAt<kErrors>(local, weights, rule.nodes[g] * duration);
    gramian.template selfadjointView<Eigen::Lower>().rankUpdate(k.transpose(),
                                                                rule.weights[g] * duration);
  }
  return gramian.template selfadjointView<Eigen::Lower>();
}

}  // namespace trueline
