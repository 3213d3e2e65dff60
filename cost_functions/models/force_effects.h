// Aerodynamic effects beyond the linear drag of Li et al. 2019, eq. 9: specific force in B that a
// better model adds to eq. 10. Wind and a step of drag change that drag itself. The physics of the
// air's other forces stands where the effect is declared (problems/effects), that of terms of the
// open catalogue in term_force.h.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/term_force.h"

namespace trueline {

// Specific force along x_B and y_B, m/s^2: a_z shows the force along z_B.
template <typename T>
using PlaneForce = Eigen::Matrix<T, 2, 1>;

// The air at the vehicle at one instant.
template <typename T>
struct AirFlow {
  Vector3<T> v_B;  // m/s, air-relative velocity
  T speed;         // m/s, its norm; a floor keeps derivatives finite at rest
  double thrust;   // m/s^2, the specific thrust T

  // Against x and y of the velocity; rate in 1/s.
  template <typename Rate>
  PlaneForce<T> Drag(const Rate& rate) const {
    return {-rate * v_B[0], -rate * v_B[1]};
  }
};

// Linear drag is multiplied by `factor` from `time` on.
struct DragStep {
  double time;  // t_step, s from the start of the log
  double factor;
};

struct ForceEffects {
  using AirForce = ForScalars<AirFlow, PlaneForce, double, MotionJet>;

  Eigen::Vector3d wind_E = Eigen::Vector3d::Zero();  // w, m/s
  std::vector<DragStep> drag_steps = {};
  std::vector<AirForce> air_forces = {};
  std::vector<SizedTerm> terms = {};
  // rad/s in I, for terms; null before the log is known (problems/vgd/term_series.h).
  std::array<std::shared_ptr<const TermSeries>, 3> rates = {};

  bool Any() const {
    return !air_forces.empty() || !wind_E.isZero(0.0) || !drag_steps.empty() || !terms.empty();
  }

  // Of linear drag at t, s from the log's start.
  double DragFactor(double t) const {
    double factor = 1.0;
    for (const DragStep& step : drag_steps) factor *= t >= step.time ? step.factor : 1.0;
    return factor;
  }

  // Adds force(size, air), unless the size is zero.
  template <class Function>
  void Add(double size, const Function& force) {
    if (size == 0.0) return;
    air_forces.emplace_back(
        [=]<typename T>(const AirFlow<T>& air) -> PlaneForce<T> { return force(size, air); });
  }

  // The specific force (B, m/s^2) that the effects add to eq. 10. K: (K_x, K_y) in 1/s. ground_B
  // and wind_B: velocity of body and air over ground, in B. thrust: T. t: s from the log's start.
  template <typename T>
  Vector3<T> AddedForce(const T& K_x, const T& K_y, const Vector3<T>& ground_B,
                        const Vector3<T>& wind_B, double thrust, double t) const {
    using std::sqrt;
    const Vector3<T> v = ground_B - wind_B;
    const T step(DragFactor(t));
    PlaneForce<T> force(K_x * (step * v[0] - ground_B[0]), K_y * (step * v[1] - ground_B[1]));
    const AirFlow<T> air{v, sqrt(v.squaredNorm() + T(1e-12)), thrust};
    for (const AirForce& term : air_forces) force += term(air);
    return Vector3<T>(force[0], force[1], T(0));
  }

  // Of the terms; what they push along z_B is part of the thrust that the accelerometer measures.
  template <typename T>
  Vector3<T> TermForce(const Matrix3<T>& R_B_I, TermState<T> state) const {
    if (rates[0]) {
      state.w_B = R_B_I * Eigen::Vector3d(rates[0]->At(state.t), rates[1]->At(state.t),
                                          rates[2]->At(state.t))
                              .template cast<T>();
    }
    Vector3<T> force = SumInBody(terms, TermOn::kForce, state);
    force[2] = T(0);
    return force;
  }

  // All of them together in I, as far as a_z does not show them. v_Ep: velocity in E';
  // p_E(): place (m), asked for by terms alone; thrust in m/s^2; t: s from the log's start.
  template <typename T, typename Place>
  Vector3<T> ForceInImu(const ImuDrivenModel<T>& model, const Eigen::Matrix3d& R_Ep_I,
                        const Vector3<T>& v_Ep, const Place& p_E, double thrust, double t) const {
    const ImuDrivenParameters<T>& p = model.parameters();
    const auto in_B = [&](const Vector3<T>& x_Ep) -> Vector3<T> {
      return model.R_B_I() * Times(R_Ep_I.transpose(), x_Ep);
    };
    const Vector3<T> v_B = in_B(v_Ep), wind_B = in_B(model.R_Ep_E() * wind_E.template cast<T>());
    Vector3<T> f_B = AddedForce(p.K_x, p.K_y, v_B, wind_B, thrust, t);
    if (!terms.empty()) {
      f_B += TermForce(model.R_B_I(), TermState<T>{v_B, Vector3<T>::Zero(), T(thrust),
                                                   model.BodyToEarth(R_Ep_I), p_E(), t});
    }
    return model.R_B_I().transpose() * model.Unseen(f_B);
  }
};

}  // namespace trueline
