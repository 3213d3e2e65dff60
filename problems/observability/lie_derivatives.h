// Lie derivatives of a system's output along its own flow, by Taylor arithmetic (Boehm et al. 2020,
// eq. 1): with x(t) the solution for the given inputs, coefficient i of y(t) is L_f^i h / i!, with
// the inputs' derivatives included. In Jets the coefficients carry their gradient with respect to
// the minimal error of x(0).
//
// A System has, for every scalar T and coefficient C:
//   kStates, kMoving (states that move, first), kErrors (dimension of the error state);
//   num_outputs(), SensorNames(), CountStates(error states), errors() -> std::vector<StateInfo>;
//   Derivative(const T* x, const T* u, T* dx): dx/dt of the first kMoving states;
//   Output(const T* x, const T* u, T* y);
//   Seed(const C* x, Jet<C, kErrors>* out): x + (first-order error) as Jets;
//   Error(const C* x, const C* dx, C* error): the error that moves x by dx, to first order.
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "cost_functions/numbers/taylor.h"
#include "problems/observability/rank.h"

namespace trueline {

// A state, and the series of the inputs there.
template <class C, int kMaxOrder>
struct SystemPoint {
  std::vector<C> x;
  std::vector<Taylor<C, kMaxOrder>> u;
};

template <class T>
struct SeriesSolution {
  std::vector<T> x;  // kStates series
  std::vector<T> y;  // num_outputs() series
};

// Solves dx/dt = f(x, u) from x0 up to t^order (order <= kMaxOrder), coefficient by coefficient:
// f of a series known to order k is known to order k, which gives x to order k + 1.
template <int kMaxOrder, class C, class System>
SeriesSolution<Taylor<C, kMaxOrder>> SolveSeries(const System& system, const std::vector<C>& x0,
                                                 const std::vector<Taylor<C, kMaxOrder>>& u,
                                                 int order) {
  using Series = Taylor<C, kMaxOrder>;
  SeriesSolution<Series> solution;
  solution.x.reserve(System::kStates);
  for (int i = 0; i < System::kStates; ++i) {
    solution.x.push_back(i < System::kMoving ? Series::Start(x0[i]) : Series::Constant(x0[i]));
  }
  std::vector<Series> dx(System::kMoving);
  for (int k = 0; k < order; ++k) {
    system.Derivative(solution.x.data(), u.data(), dx.data());
    const C scale = MakeScalar<C>(1.0) / MakeScalar<C>(k + 1);
    for (int i = 0; i < System::kMoving; ++i) solution.x[i].Append(dx[i][k] * scale);
  }
  solution.y.resize(system.num_outputs());
  system.Output(solution.x.data(), u.data(), solution.y.data());
  return solution;
}

// The same in Jets of `columns` (at most kColumns) of `seeded`, which is the state at the start
// with its gradient by all errors (System::Seed); the inputs carry no gradient.
template <int kColumns, int kMaxOrder, class C, class System>
SeriesSolution<Taylor<ceres::Jet<C, kColumns>, kMaxOrder>> SolveSeriesWithGradient(
    const System& system, const std::vector<ceres::Jet<C, System::kErrors>>& seeded,
    const std::vector<Taylor<C, kMaxOrder>>& u, int order, std::span<const int> columns) {
  using Jet = ceres::Jet<C, kColumns>;
  std::vector<Jet> start;
  start.reserve(seeded.size());
  for (const auto& state : seeded) {
    start.emplace_back(state.a);
    for (std::size_t j = 0; j < columns.size(); ++j) start.back().v[j] = state.v[columns[j]];
  }
  std::vector<Taylor<Jet, kMaxOrder>> inputs;
  for (const auto& series : u) {
    auto input = Taylor<Jet, kMaxOrder>::Constant(Jet(series[0]));
    if (series.degree() > 0 || series.order() < kMaxOrder) {
      input = Taylor<Jet, kMaxOrder>::Start(Jet(series[0]));
      for (int i = 1; i <= series.order(); ++i) input.Append(Jet(series[i]));
    }
    inputs.push_back(input);
  }
  return SolveSeries<kMaxOrder, Jet, System>(system, start, inputs, order);
}

template <class C, class System>
std::vector<ceres::Jet<C, System::kErrors>> Seeded(const System& system, const std::vector<C>& x0) {
  std::vector<ceres::Jet<C, System::kErrors>> seeded(System::kStates);
  system.Seed(x0.data(), seeded.data());
  return seeded;
}

// The observability matrix: for i = 0 ... order the gradients of the i-th Lie derivative of every
// output, divided by i!; (order + 1) * num_outputs rows, kErrors columns.
template <int kMaxOrder, class C, class System>
DynamicMatrix<C> ObservabilityMatrix(const System& system, const std::vector<C>& x0,
                                     const std::vector<Taylor<C, kMaxOrder>>& u, int order) {
  std::array<int, System::kErrors> all;
  std::iota(all.begin(), all.end(), 0);
  const auto solution = SolveSeriesWithGradient<System::kErrors, kMaxOrder, C, System>(
      system, Seeded(system, x0), u, order, all);
  const int outputs = system.num_outputs();
  DynamicMatrix<C> matrix((order + 1) * outputs, System::kErrors);
  for (int i = 0; i <= order; ++i) {
    for (int row = 0; row < outputs; ++row) {
      matrix.row(i * outputs + row) = solution.y[row][i].v.transpose();
    }
  }
  return matrix;
}

// The observability of one short stretch of time by a Taylor series (Boehm et al. 2020, eq. 2-4).

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
