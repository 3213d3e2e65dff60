// What the IMU-driven model leaves out, as Wiener processes: unmodelled acceleration as white noise
// (velocity walks), and the AHRS error as a slow walk that tilts gravity into the horizontal.
#pragma once

#include <Eigen/Core>

namespace trueline {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

// Strengths as one-sided root spectral densities.
struct ProcessNoise {
  double acceleration = 0.0;  // m/s^2/sqrt(Hz), for each axis
  double tilt = 0.0;          // rad/sqrt(s), for phi and theta of E' against E
  double heading = 0.0;       // rad/sqrt(s), for psi
};

// Covariance of (p_E, v_E, Phi_E_Ep) after `seconds`, starting from zero. Exact for near-level
// specific force (0, 0, -g): dp = v, dv = M Phi + noise, dPhi = noise, M Phi = g (-theta, phi, 0).
// Units m, m/s, rad.
inline Matrix9d ProcessCovariance(const ProcessNoise& noise, double seconds, double gravity) {
  const double t = seconds, t2 = t * t, t3 = t2 * t;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  M(0, 1) = -gravity;
  M(1, 0) = gravity;
  const double q_a = noise.acceleration * noise.acceleration;
  const Eigen::Matrix3d Q = Eigen::Vector3d(noise.tilt * noise.tilt, noise.tilt * noise.tilt,
                                            noise.heading * noise.heading)
                                .asDiagonal();
  const Eigen::Matrix3d MQ = M * Q, MQM = MQ * M.transpose();
  Matrix9d cov;
  cov.block<3, 3>(0, 0) = I * (q_a * t3 / 3.0) + MQM * (t3 * t2 / 20.0);
  cov.block<3, 3>(0, 3) = I * (q_a * t2 / 2.0) + MQM * (t2 * t2 / 8.0);
  cov.block<3, 3>(0, 6) = MQ * (t3 / 6.0);
  cov.block<3, 3>(3, 3) = I * (q_a * t) + MQM * (t3 / 3.0);
  cov.block<3, 3>(3, 6) = MQ * (t2 / 2.0);
  cov.block<3, 3>(6, 6) = Q * t;
  cov.block<3, 3>(3, 0) = cov.block<3, 3>(0, 3).transpose();
  cov.block<3, 3>(6, 0) = cov.block<3, 3>(0, 6).transpose();
  cov.block<3, 3>(6, 3) = cov.block<3, 3>(3, 6).transpose();
  return cov;
}

}  // namespace trueline
