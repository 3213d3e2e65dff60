// The empirical observability Gramian of Krener and Ide 2009: the flight is simulated again with
// each error state perturbed to either side. Slow but independent of all derivatives: a
// cross-check. A System has errors() and an overload of Perturbed.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "problems/observability/rotor_driven_system.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

// `x` with one error state moved by a finite amount.
inline std::vector<double> Perturbed(const RotorDrivenSystem&, std::vector<double> x, int error,
                                     double by) {
  if (error >= 3) {
    x[error + 1] += by;
    return x;
  }
  Vec4<double> turn(std::cos(0.5 * by), 0.0, 0.0, 0.0);
  turn[1 + error] = std::sin(0.5 * by);
  const Vec4<double> q = HamiltonProduct(Vec4<double>(x[0], x[1], x[2], x[3]), turn);
  for (int i = 0; i < 4; ++i) x[i] = q[i];
  return x;
}

// Outputs at the ends of `steps` Runge-Kutta steps, num_outputs x (steps + 1), from `x` with the
// flight's inputs.
template <class System>
Eigen::MatrixXd SimulateOutputs(const System& system, const NominalFlight& flight,
                                std::vector<double> x, int steps) {
  const double h = (flight.end - flight.start) / steps;
  Eigen::MatrixXd outputs(system.num_outputs(), steps + 1);
  std::vector<double> k[4], u = flight.at(flight.start).u;
  for (auto& slope : k) slope.resize(System::kMoving);
  const auto moved = [&](const std::vector<double>& slope, double by) {
    std::vector<double> result = x;
    for (int i = 0; i < System::kMoving; ++i) result[i] += by * slope[i];
    return result;
  };
  for (int step = 0;; ++step) {
    system.Output(x.data(), u.data(), outputs.col(step).data());
    if (step == steps) return outputs;
    const double t = flight.start + step * h;
    const std::vector<double> u_middle = flight.at(t + 0.5 * h).u, u_end = flight.at(t + h).u;
    system.Derivative(x.data(), u.data(), k[0].data());
    system.Derivative(moved(k[0], 0.5 * h).data(), u_middle.data(), k[1].data());
    system.Derivative(moved(k[1], 0.5 * h).data(), u_middle.data(), k[2].data());
    system.Derivative(moved(k[2], h).data(), u_end.data(), k[3].data());
    for (int i = 0; i < System::kMoving; ++i) {
      x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    }
    u = u_end;
  }
}

// Central differences of `relative` times each state's typical size. Simpson's rule on steps of at
// most `step` seconds; `weights` as in E2log.
template <class System>
Eigen::MatrixXd EmpiricalGramian(const System& system, const NominalFlight& flight,
                                 const std::vector<double>& weights, double step,
                                 double relative = 1e-3) {
  const double duration = flight.end - flight.start;
  const int steps = 2 * std::max(1, static_cast<int>(std::ceil(duration / step / 2.0 - 1e-9)));
  const NominalPoint start = flight.at(flight.start);
  Eigen::MatrixXd rows(system.num_outputs() * (steps + 1), System::kErrors);
  for (int column = 0; column < System::kErrors; ++column) {
    const double size = relative * system.errors()[column].typical;
    const auto outputs = [&](double by) {
      return SimulateOutputs(system, flight, Perturbed(system, start.x, column, by), steps);
    };
    Eigen::MatrixXd difference = (outputs(size) - outputs(-size)) / (2.0 * size);
    for (int i = 0; i <= steps; ++i) {
      const double w = (i == 0 || i == steps ? 1.0
                        : i % 2 == 1         ? 4.0
                                             : 2.0) *
                       duration / steps / 3.0;
      for (int row = 0; row < system.num_outputs(); ++row) {
        difference(row, i) *= weights[row] * std::sqrt(w);
      }
    }
    rows.col(column) = Eigen::Map<const Eigen::VectorXd>(difference.data(), difference.size());
  }
  return rows.transpose() * rows;
}

}  // namespace trueline
