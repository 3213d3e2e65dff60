#include "problems/simulation/airframe.h"

namespace trueline::simulation {
namespace {

BodyState AddScaled(const BodyState& state, double h, const BodyState& rate) {
  BodyState sum;
  sum.p_E = state.p_E + h * rate.p_E;
  sum.v_E = state.v_E + h * rate.v_E;
  sum.q_E_B = state.q_E_B + h * rate.q_E_B;
  sum.w_B = state.w_B + h * rate.w_B;
  sum.rotors = state.rotors + h * rate.rotors;
  return sum;
}

}  // namespace

Airframe::Airframe(const VehicleConfig& vehicle, double gravity, const Stages& stages)
    : vehicle_(vehicle), gravity_(gravity), stages_(stages), motor_lag_(vehicle.motor_lag) {
  Quaterniond turned = Quaterniond::Identity();
  Apply(stages_.thrust_axis, &turned);
  for (const Rotor& rotor : vehicle_.rotors) axes_B_.push_back(turned * rotor.axis);
  Apply(stages_.motor_lag, &motor_lag_);
  if (!vehicle_.blades) return;
  for (std::size_t i = 0; i < axes_B_.size(); ++i) {
    Rotor rotor = vehicle_.rotors[i];
    rotor.axis = axes_B_[i];
    blades_.emplace_back(*vehicle_.blades, rotor);
  }
}

// In air at rest k_f u n and spin k_m u n with u = omega^2: a rotor that spins clockwise seen from
// above (n up) turns the body the other way.
HubWrench Airframe::HubWrenchOf(int rotor, const Flow& flow, double speed) const {
  const Rotor& of = vehicle_.rotors[rotor];
  if (!blades_.empty() && speed > 0.0) {
    return blades_[rotor].WrenchOn({flow.v_B + flow.w_B.cross(of.position), flow.w_B, speed});
  }
  const Vector3d& axis_B = axes_B_[rotor];
  return {of.k_f * speed * speed * axis_B, of.spin * of.k_m * speed * speed * axis_B};
}

Airframe::Wrench Airframe::RotorWrench(const Flow& flow, const RotorArray& rotors,
                                       const Vector3d& com) const {
  Wrench total;
  for (int i = 0; i < rotors.size(); ++i) {
    double factor = 1.0;
    Apply(stages_.rotor, flow, i, &factor);
    const HubWrench hub = HubWrenchOf(i, flow, rotors[i]);
    const Vector3d force = factor * hub.force_B;
    total.force_B += force;
    total.moment_B += (vehicle_.rotors[i].position - com).cross(force) + hub.moment_B;
  }
  return total;
}

// A rotor that turns clockwise seen from above has its angular momentum along its downward axis.
Vector3d Airframe::MomentumOf(const RotorArray& speeds) const {
  Vector3d momentum = Vector3d::Zero();
  if (vehicle_.rotor_inertia == 0.0) return momentum;
  for (int i = 0; i < speeds.size(); ++i) {
    momentum -= vehicle_.rotor_inertia * vehicle_.rotors[i].spin * speeds[i] * axes_B_[i];
  }
  return momentum;
}

BodyRate Airframe::Rate(double t, const BodyState& state, const RotorArray& command,
                        const Vector3d& gust_E, const Vector3d& twist_B) const {
  const Eigen::Matrix3d R_E_B = state.Attitude().toRotationMatrix();
  Load load{vehicle_.mass, Vector3d::Zero()};
  Apply(stages_.load, t, &load);
  Vector3d w_E = Vector3d::Zero();
  Apply(stages_.wind, t, &w_E);
  Vector3d drag = vehicle_.drag;
  Apply(stages_.drag, t, &drag);

  Flow flow{t,
            R_E_B.transpose() * (state.v_E - w_E),
            0.0,
            state.rotors.sum(),
            -state.p_E.z(),
            R_E_B.transpose() * state.v_E,
            state.w_B,
            state.p_E,
            R_E_B};
  const Wrench wrench = RotorWrench(flow, state.rotors, load.com);
  flow.thrust = -wrench.force_B.z() / load.mass;

  BodyRate result;
  result.thrust = flow.thrust;
  result.f_B =
      wrench.force_B / load.mass + drag.cwiseProduct(flow.v_B) + R_E_B.transpose() * gust_E;
  Apply(stages_.force, flow, &result.f_B);

  Vector3d turn_B = twist_B;
  Apply(stages_.turn, flow, &turn_B);
  Vector3d moment_B = wrench.moment_B;
  Apply(stages_.moment, flow, &moment_B);
  result.rate.rotors = (command - state.rotors) / motor_lag_;
  // The body's and the rotors' own angular momentum turn together; the body takes up what changes
  // the rotors'.
  moment_B -= MomentumOf(result.rate.rotors);
  const Vector3d angular_momentum =
      vehicle_.inertia.cwiseProduct(state.w_B) + MomentumOf(state.rotors);
  result.rate.p_E = state.v_E;
  const Quaterniond spin(0.0, state.w_B.x(), state.w_B.y(), state.w_B.z());
  result.rate.q_E_B = 0.5 * (state.Attitude() * spin).coeffs();
  result.rate.w_B =
      (moment_B - state.w_B.cross(angular_momentum)).cwiseQuotient(vehicle_.inertia) + turn_B;
  // f_B refers to the centre of mass as built; a centre displaced by `com` rotates about itself.
  result.f_B -= result.rate.w_B.cross(load.com) + state.w_B.cross(state.w_B.cross(load.com));
  result.rate.v_E = R_E_B * result.f_B + Vector3d(0.0, 0.0, gravity_);
  return result;
}

BodyState Airframe::Step(double t, double dt, const BodyState& state, const RotorArray& command,
                         const Vector3d& gust_E, const Vector3d& twist_B) const {
  const BodyState k1 = Rate(t, state, command, gust_E, twist_B).rate;
  const BodyState k2 =
      Rate(t + dt / 2, AddScaled(state, dt / 2, k1), command, gust_E, twist_B).rate;
  const BodyState k3 =
      Rate(t + dt / 2, AddScaled(state, dt / 2, k2), command, gust_E, twist_B).rate;
  const BodyState k4 = Rate(t + dt, AddScaled(state, dt, k3), command, gust_E, twist_B).rate;
  BodyState next = AddScaled(state, dt / 6, k1);
  next = AddScaled(next, dt / 3, k2);
  next = AddScaled(next, dt / 3, k3);
  next = AddScaled(next, dt / 6, k4);
  next.q_E_B.normalize();
  return next;
}

}  // namespace trueline::simulation
