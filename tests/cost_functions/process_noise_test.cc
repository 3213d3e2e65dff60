// The covariance of the process noise against quadrature and sampling of its definition.
#include "cost_functions/models/process_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/common/random.h"

namespace trueline {
namespace {

constexpr double kG = 9.81;
const ProcessNoise kNoise{
    .acceleration = 0.3, .thrust_factor = 2.0, .tilt = 0.05, .heading = 0.02, .memory = 0.8};

const Eigen::Vector3d kThrustAxis(0.6, 0.0, 0.8);

// dx = F x dt + L dw with x = (p, v, drift): F holds dp = v and dv = g (-theta, phi, 0).
Matrix9d SystemMatrix() {
  Matrix9d F = Matrix9d::Zero();
  F.block<3, 3>(0, 3).setIdentity();
  F(3, 7) = -kG;
  F(4, 6) = kG;
  return F;
}

// Spectral density by its definition: the drift reaches (1 - alpha^2) of its stationary variance.
Matrix9d Density(double seconds) {
  const double reached = 1.0 - std::exp(-2.0 * seconds / kNoise.memory);
  Matrix9d Q = Matrix9d::Zero();
  // 0.3 across the axis, twice as much along it.
  const Eigen::Matrix3d along = kThrustAxis * kThrustAxis.transpose();
  Q.block<3, 3>(3, 3) = 0.09 * (Eigen::Matrix3d::Identity() - along) + 0.36 * along;
  Q.diagonal().tail<3>() = Eigen::Vector3d(0.0025, 0.0025, 0.0004) * reached / seconds;
  return Q;
}

TEST(ProcessCovariance, SolvesItsLyapunovEquation) {
  for (const double seconds : {0.1, 0.5, 2.0}) {
    const Matrix9d F = SystemMatrix(), Q = Density(seconds);
    const auto rate = [&](const Matrix9d& P) -> Matrix9d { return F * P + P * F.transpose() + Q; };
    Matrix9d P = Matrix9d::Zero();
    const int steps = 200;
    const double h = seconds / steps;
    for (int i = 0; i < steps; ++i) {  // Runge-Kutta
      const Matrix9d k1 = rate(P), k2 = rate(P + k1 * h / 2), k3 = rate(P + k2 * h / 2),
                     k4 = rate(P + k3 * h);
      P += (k1 + 2 * k2 + 2 * k3 + k4) * h / 6;
    }
    EXPECT_LT((ProcessCovariance(kNoise, seconds, kG, kThrustAxis) - P).norm(), 1e-6 * P.norm())
        << seconds;
  }
}

TEST(ProcessCovariance, AgreesWithSampledPaths) {
  const double seconds = 0.8;
  const int paths = 4000, steps = 40;
  const Matrix9d root = Eigen::SelfAdjointEigenSolver<Matrix9d>(Density(seconds)).operatorSqrt();
  const Matrix9d F = SystemMatrix();
  const double h = seconds / steps;
  Random random(7, "paths");
  Matrix9d sum = Matrix9d::Zero();
  for (int k = 0; k < paths; ++k) {
    Eigen::Matrix<double, 9, 1> x = Eigen::Matrix<double, 9, 1>::Zero();
    for (int i = 0; i < steps; ++i) {
      Eigen::Matrix<double, 9, 1> drawn;
      for (int j = 0; j < 9; ++j) drawn[j] = random.Normal();
      const Eigen::Matrix<double, 9, 1> noise = std::sqrt(h) * root * drawn;
      const Eigen::Matrix<double, 9, 1> middle = x + 0.5 * noise;
      x += F * (middle + 0.5 * h * F * middle) * h + noise;
    }
    sum += x * x.transpose();
  }
  const Matrix9d cov = ProcessCovariance(kNoise, seconds, kG, kThrustAxis);
  const Eigen::Matrix<double, 9, 1> sigma = cov.diagonal().cwiseSqrt();
  const Matrix9d difference = sum / paths - cov;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) EXPECT_LT(std::abs(difference(i, j)), 0.08 * sigma[i] * sigma[j]);
  }
}

// The tilt's effect on the velocity (the matrix M) is that of the model itself near level flight.
TEST(ProcessCovariance, TiltsGravityAsTheModelDoes) {
  const Drive hover{Eigen::Matrix3d::Identity(), -kG};
  const Matrix9d cov = ProcessCovariance(kNoise, 0.5, kG, Eigen::Vector3d::UnitZ());
  const double gain = 0.25 / 2.0;  // of cov(v, drift) = M Q t^2 / 2
  for (int axis = 0; axis < 3; ++axis) {
    ImuDrivenParameters<double> p;
    p.Phi_E_Ep[axis] = 1e-5;
    const Eigen::Vector3d a =
        ImuDrivenModel<double>(p, kG).Acceleration(hover, Eigen::Vector3d::Zero());
    const double q = Density(0.5)(6 + axis, 6 + axis);
    const Eigen::Vector3d expected = a / 1e-5 * q * gain;
    EXPECT_LT((cov.block<3, 1>(3, 6 + axis) - expected).norm(), 1e-3 * expected.norm() + 1e-9);
  }
}

TEST(ProcessNoise, DecaysOverItsMemory) {
  EXPECT_NEAR(kNoise.Decay(0.8), std::exp(-1.0), 1e-15);
  EXPECT_FALSE(ProcessNoise().Any());
  EXPECT_TRUE((ProcessNoise{.heading = 0.1}.Any()));
}

}  // namespace
}  // namespace trueline
