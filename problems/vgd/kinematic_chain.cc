#include "problems/vgd/kinematic_chain.h"

#include <ceres/jet.h>

#include <cmath>

#include "cost_functions/models/rotation.h"

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

Eigen::MatrixXd PathDeviations(const std::vector<KinematicNode>& nodes, const ImuNoise& noise,
                               double gravity) {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd D = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  const Eigen::Vector3d g(0.0, 0.0, gravity);
  const double sigma_gyro = std::sqrt(noise.GyroSpectrum().mean());
  for (Eigen::Index k = 0; k + 1 < count; ++k) {
    const double root = std::sqrt(nodes[k + 1].elapsed - nodes[k].elapsed);
    const auto& from = nodes[k].value;
    for (Eigen::Index i = k + 1; i < count; ++i) {
      const double t = nodes[i].elapsed - nodes[k].elapsed;
      const auto& to = nodes[i].value;
      const Eigen::Vector3d V = to.tail<3>() - from.tail<3>() - g * t;
      const Eigen::Vector3d P =
          to.head<3>() - from.head<3>() - from.tail<3>() * t - g * (0.5 * t * t);
      auto effect = D.block<6, 6>(6 * i, 6 * k);
      effect.topLeftCorner<3, 3>() = Skew<double>(P) * (-sigma_gyro * root);
      effect.bottomLeftCorner<3, 3>() = Skew<double>(V) * (-sigma_gyro * root);
      effect.topRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root * t);
      effect.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * (noise.accel * root);
    }
  }
  return D;
}

}  // namespace trueline
