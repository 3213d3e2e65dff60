// The observability of one short stretch of time by a Taylor series (Boehm et al. 2020, eq. 2-4).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

#include "problems/observability/lie_derivatives.h"

namespace trueline {

// Nodes (ascending) and weights on [0, 1], exact for polynomials of degree 2 kNodes - 1.
struct Quadrature {
  std::vector<double> nodes, weights;
};
template <int kNodes>
const Quadrature& GaussLegendre() {
  static const Quadrature rule = [] {
    using Gauss = boost::math::quadrature::gauss<double, kNodes>;  // of x >= 0 in [-1, 1]
    const auto& x = Gauss::abscissa();
    Quadrature unit;
    const auto add = [&](std::size_t i, double sign) {
      unit.nodes.push_back(0.5 * (1.0 - sign * x[i]));
      unit.weights.push_back(0.5 * Gauss::weights()[i]);
    };
    for (std::size_t i = x.size(); i-- > 0;) add(i, 1.0);
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (x[i] > 0.0) add(i, -1.0);
    }
    return unit;
  }();
  return rule;
}

inline constexpr int kJetColumns =
    12;  // of the rotor-driven model, 21 errors are curved, 12 affine

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

// Writes the columns of `local` that `columns` name, by series up to t^order.
template <int kColumns, int kOrder, class C, class System>
void ExpandColumns(const System& system, const std::vector<ceres::Jet<C, System::kErrors>>& seeded,
                   const std::vector<Taylor<C, kOrder>>& u, double duration, int order,
                   std::span<const int> columns, LocalSensitivity<C, System::kErrors>* local) {
  using Jet = ceres::Jet<C, kColumns>;
  const auto solution =
      SolveSeriesWithGradient<kColumns, kOrder, C, System>(system, seeded, u, order, columns);
  const int count = static_cast<int>(columns.size());
  for (int i = 0; i <= kOrder; ++i) {
    for (int row = 0; row < system.num_outputs(); ++row) {
      const Jet y = solution.y[row][i];
      for (int j = 0; j < count; ++j) local->gradients[i](row, columns[j]) = y.v[j];
    }
  }
  std::vector<Jet> end;
  std::vector<C> x_end, dx(System::kStates), error(System::kErrors);
  for (const auto& series : solution.x) {
    end.push_back(series.degree() == 0 ? series[0] : Evaluate(series, duration));
    x_end.push_back(end.back().a);
  }
  for (int j = 0; j < count; ++j) {
    for (int i = 0; i < System::kStates; ++i) dx[i] = end[i].v[j];
    system.Error(x_end.data(), dx.data(), error.data());
    for (int i = 0; i < System::kErrors; ++i) local->transition(i, columns[j]) = error[i];
  }
}

// In Jets of a few errors, which stay in registers; for other scalars than double in Jets of all,
// because each Jet evaluates the values again.
template <int kOrder, class C, class System>
LocalSensitivity<C, System::kErrors> ExpandSensitivity(const System& system,
                                                       const std::vector<C>& x0,
                                                       const std::vector<Taylor<C, kOrder>>& u,
                                                       double duration) {
  constexpr int kErrors = System::kErrors;
  constexpr int kColumns = std::is_same_v<C, double> ? std::min(kErrors, kJetColumns) : kErrors;
  LocalSensitivity<C, kErrors> local;
  local.gradients.assign(kOrder + 1, {system.num_outputs(), kErrors});
  local.transition.resize(kErrors, kErrors);
  std::vector<int> curved, affine;
  for (int i = 0; i < kErrors; ++i) {
    bool is_affine = false;
    if constexpr (requires { System::AffineInTime(i); }) is_affine = System::AffineInTime(i);
    (is_affine ? affine : curved).push_back(i);
  }
  const auto seeded = Seeded(system, x0);
  const auto expand = [&](std::span<const int> columns, int order) {
    for (std::size_t first = 0; first < columns.size(); first += kColumns) {
      ExpandColumns<kColumns>(
          system, seeded, u, duration, order,
          columns.subspan(first, std::min<std::size_t>(kColumns, columns.size() - first)), &local);
    }
  };
  expand(curved, kOrder);
  expand(affine, std::min(kOrder, 1));
  return local;
}

// K at `t`.
template <int kErrors>
typename LocalSensitivity<double, kErrors>::Matrix SensitivityAt(
    const LocalSensitivity<double, kErrors>& local, double t) {
  auto k = local.gradients.back();
  for (int i = static_cast<int>(local.gradients.size()) - 2; i >= 0; --i) {
    k = k * t + local.gradients[i];
  }
  return k;
}

// Integral of K'K over the stretch (eq. 3), the rows of K scaled by `weights`, including all cross
// terms of the series. K is a polynomial of degree kOrder, so Gauss' rule is exact.
template <int kErrors, int kOrder>
Eigen::Matrix<double, kErrors, kErrors> LocalGramian(const LocalSensitivity<double, kErrors>& local,
                                                     const std::vector<double>& weights,
                                                     double duration) {
  const Eigen::Map<const Eigen::VectorXd> weight(weights.data(), weights.size());
  const Quadrature& rule = GaussLegendre<kOrder + 1>();
  const Eigen::Index rows = weight.size();
  // All nodes below each other: one product instead of many small ones.
  Eigen::Matrix<double, Eigen::Dynamic, kErrors> k(rows * rule.nodes.size(), kErrors);
  for (std::size_t g = 0; g < rule.nodes.size(); ++g) {
    k.middleRows(g * rows, rows) = std::sqrt(rule.weights[g] * duration) * weight.asDiagonal() *
                                   SensitivityAt<kErrors>(local, rule.nodes[g] * duration);
  }
  Eigen::Matrix<double, kErrors, kErrors> gramian;
  gramian.setZero();
  gramian.template selfadjointView<Eigen::Lower>().rankUpdate(k.transpose());
  return gramian.template selfadjointView<Eigen::Lower>();
}

}  // namespace trueline
