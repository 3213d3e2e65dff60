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

#include <array>
#include <numeric>
#include <span>
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

}  // namespace trueline
