#include "problems/vgd/kinematic_chain.h"

#include <ceres/jet.h>

#include <cmath>

namespace trueline {
namespace {

using BiasJet = ceres::Jet<double, 6>;  // b_a, b_g

// Value and derivatives of three numbers.
void Split(const Vector3<BiasJet>& x, Eigen::Vector3d* value, Eigen::Matrix3d* d_ba,
           Eigen::Matrix3d* d_bg) {
  for (int i = 0; i < 3; ++i) {
    (*value)[i] = x[i].a;
    d_ba->row(i) = x[i].v.head<3>().transpose();
    d_bg->row(i) = x[i].v.tail<3>().transpose();
  }
}

}  // namespace

KinematicBlock SumUp(const ImuInputs& imu, TimeNs t0, TimeNs t1) {
  ImuBias<BiasJet> bias;
  for (int i = 0; i < 3; ++i) {
    bias.accel[i] = BiasJet(0.0, i);
    bias.gyro[i] = BiasJet(0.0, 3 + i);
  }
  KinematicBlock block;
  KinematicState<BiasJet> x;
  imu.ForEachStep(t0, t1, [&](const ImuInput& input, double dt) {
    const Eigen::Quaterniond q(x.q_E_I.w().a, x.q_E_I.x().a, x.q_E_I.y().a, x.q_E_I.z().a);
    const Eigen::Vector3d half_turn = input.gyro * (0.25 * dt);
    const Eigen::Quaterniond q_mid = q * RotationFromHalfVector<double>(half_turn);
    block.R_tau_dt += q_mid.toRotationMatrix() * ((block.h + 0.5 * dt) * dt);
    KinematicStep(input, bias, 0.0, dt, &x);
    block.h += dt;
  });
  Split(x.v, &block.v, &block.d_v_ba, &block.d_v_bg);
  Split(x.p, &block.p, &block.d_p_ba, &block.d_p_bg);
  const Eigen::Quaternion<BiasJet>& q = x.q_E_I;
  block.turn = Eigen::Quaterniond(q.w().a, q.x().a, q.y().a, q.z().a).normalized();
  const Eigen::Quaternion<BiasJet> error = block.turn.conjugate().cast<BiasJet>() * q;
  Eigen::Vector3d none;
  Eigen::Matrix3d no_effect;
  Split(error.vec() * BiasJet(2.0), &none, &no_effect, &block.d_turn_bg);
  return block;
}

KinematicChain::KinematicChain(const ImuInputs& imu, TimeNs start, std::vector<TimeNs> times,
                               double max_block)
    : gravity_(imu.track().gravity()), start_(start), times_(std::move(times)) {
  TimeNs from = start;
  for (const TimeNs time : times_) {
    const double span = SecondsBetween(from, time);
    const int pieces = static_cast<int>(std::ceil(span / max_block - 1e-9));
    for (int k = 0; k < pieces; ++k) {
      const TimeNs length = time - from;
      blocks_.push_back(SumUp(imu, from + length * k / pieces, from + length * (k + 1) / pieces));
    }
    block_ends_.push_back(blocks_.size());
    from = time;
  }
}

}  // namespace trueline
