// The observability Gramian by the variational equation, the reference for E2LOG: sensitivities are
// integrated along the nominal flight by Runge-Kutta in Jets seeded in the minimal error state.
// Weighted by the sensors' noise it is the Fisher information.
#pragma once

#include <ceres/jet.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/observability/assessment.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

// Sensitivities along a nominal flight: d(error at t) / d(error at the start), step by step.
template <class System>
class SensitivityIntegrator {
 public:
  static constexpr int kErrors = System::kErrors;
  using Jet = ceres::Jet<double, kErrors>;
  using Square = Eigen::Matrix<double, kErrors, kErrors>;

  SensitivityIntegrator(const System& system, const NominalPoint& start) : system_(system) {
    sensitivity_.setIdentity();
    Restart(start);
  }

  // d(outputs) / d(error at the start), num_outputs x kErrors, rows scaled by `weights`.
  Eigen::Matrix<double, Eigen::Dynamic, kErrors> Output(const std::vector<double>& weights) const {
    std::vector<Jet> y(system_.num_outputs());
    system_.Output(x_.data(), u_.data(), y.data());
    Eigen::Matrix<double, Eigen::Dynamic, kErrors> k(y.size(), kErrors);
    for (std::size_t i = 0; i < y.size(); ++i) k.row(i) = weights[i] * y[i].v.transpose();
    return k;
  }

  // One classical Runge-Kutta step of h seconds. The state is then reset to the flight's, so that
  // integration errors do not accumulate.
  void Step(double h, const NominalPoint& middle, const NominalPoint& end) {
    const std::vector<Jet> u_middle = Inputs(middle), u_end = Inputs(end);
    std::vector<Jet> k1(System::kMoving), k2 = k1, k3 = k1, k4 = k1;
    system_.Derivative(x_.data(), u_.data(), k1.data());
    system_.Derivative(Moved(k1, 0.5 * h).data(), u_middle.data(), k2.data());
    system_.Derivative(Moved(k2, 0.5 * h).data(), u_middle.data(), k3.data());
    system_.Derivative(Moved(k3, h).data(), u_end.data(), k4.data());
    for (int i = 0; i < System::kMoving; ++i) {
      x_[i] += (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * (h / 6.0);
    }
    Collect();
    Restart(end);
  }

  const Square& sensitivity() const { return sensitivity_; }

 private:
  static std::vector<Jet> Inputs(const NominalPoint& point) {
    std::vector<Jet> u;
    for (const double value : point.u) u.emplace_back(value);
    return u;
  }
  std::vector<Jet> Moved(const std::vector<Jet>& slope, double h) const {
    std::vector<Jet> moved = x_;
    for (int i = 0; i < System::kMoving; ++i) moved[i] += slope[i] * h;
    return moved;
  }
  // The error state's sensitivity from that of the state.
  void Collect() {
    std::vector<double> x(System::kStates), dx(System::kStates), error(kErrors);
    for (int i = 0; i < System::kStates; ++i) x[i] = x_[i].a;
    for (int column = 0; column < kErrors; ++column) {
      for (int i = 0; i < System::kStates; ++i) dx[i] = x_[i].v[column];
      system_.Error(x.data(), dx.data(), error.data());
      for (int i = 0; i < kErrors; ++i) sensitivity_(i, column) = error[i];
    }
  }
  void Restart(const NominalPoint& point) {
    std::vector<Jet> basis(System::kStates);
    system_.Seed(point.x.data(), basis.data());
    for (int i = 0; i < System::kMoving; ++i) {
      basis[i].v = (sensitivity_.transpose() * basis[i].v).eval();
    }
    x_ = std::move(basis);
    u_ = Inputs(point);
  }

  const System& system_;
  std::vector<Jet> x_, u_;
  Square sensitivity_;
};

// Integral of K'K over the flight for the error state at its start, kErrors x kErrors, by Simpson's
// rule with steps of at most `step` seconds. `weights` as in E2log.
template <class System>
Eigen::MatrixXd VariationalGramian(const System& system, const NominalFlight& flight,
                                   const std::vector<double>& weights, double step) {
  const double duration = flight.end - flight.start;
  const int steps = 2 * std::max(1, static_cast<int>(std::ceil(duration / step / 2.0 - 1e-9)));
  const double h = duration / steps;
  SensitivityIntegrator<System> integrator(system, flight.at(flight.start));
  Eigen::Matrix<double, System::kErrors, System::kErrors> gramian;
  gramian.setZero();
  for (int i = 0; i <= steps; ++i) {
    const double weight = (i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * h / 3.0;
    const auto k = integrator.Output(weights);
    gramian.template selfadjointView<Eigen::Lower>().rankUpdate(k.transpose(), weight);
    if (i == steps) break;
    const double t = flight.start + i * h;
    integrator.Step(h, flight.at(t + 0.5 * h), flight.at(t + h));
  }
  return gramian.template selfadjointView<Eigen::Lower>();
}

// Information on a system's constants for a model that is accurate only over short times: the
// flight is cut into stretches of `horizon` seconds, each with its own trajectory states, and the
// information on the constants is summed. A model without process noise would claim that twenty
// seconds of tumbling show the centre of mass to nanometres. With the horizon set to the time over
// which the model predicts well, the bounds are attainable.

// The constants out of `asked`.
inline std::vector<int> ConstantsOf(const std::vector<int>& asked,
                                    const std::vector<StateInfo>& info) {
  std::vector<int> constants;
  for (const int state : asked) {
    if (!info[state].moving) constants.push_back(state);
  }
  return constants;
}

// kErrors x kErrors; rows and columns of trajectory states and of states outside of `asked` are
// zero. `step` is that of VariationalGramian.
template <class System>
Eigen::MatrixXd WindowedInformation(const System& system, const NominalFlight& flight,
                                    const std::vector<double>& weights,
                                    const std::vector<int>& asked, double horizon, double step) {
  const std::vector<int> constants = ConstantsOf(asked, system.errors());
  const std::vector<int> moving = Others(asked, constants);
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(System::kErrors, System::kErrors);
  const int windows =
      std::max(1, static_cast<int>(std::lround((flight.end - flight.start) / horizon)));
  const double length = (flight.end - flight.start) / windows;
  for (int k = 0; k < windows; ++k) {
    NominalFlight part = flight;
    part.start = flight.start + k * length;
    part.end = part.start + length;
    const Eigen::MatrixXd information =
        SchurComplement(VariationalGramian(system, part, weights, step), constants, moving);
    for (std::size_t i = 0; i < constants.size(); ++i) {
      for (std::size_t j = 0; j < constants.size(); ++j) {
        total(constants[i], constants[j]) += information(i, j);
      }
    }
  }
  return total;
}

}  // namespace trueline
