#include "cost_functions/models/rotation.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <Eigen/Core>

#include "cost_functions/models/cubic_path.h"

namespace trueline {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

const Vector3d kAngles[] = {{0, 0, 0}, {1e-8, -1e-8, 1e-8}, {0.3, -0.5, 2.9}, {-3.0, 1.2, -0.7}};

// Independent reference: the three successive rotations by Eigen's angle-axis.
Matrix3d ReferenceRotation(const Vector3d& Phi) {
  return (AngleAxisd(Phi[2], Vector3d::UnitZ()) * AngleAxisd(Phi[1], Vector3d::UnitY()) *
          AngleAxisd(Phi[0], Vector3d::UnitX()))
      .toRotationMatrix()
      .transpose();
}

TEST(Rotation, MatrixMatchesSuccessiveRotations) {
  for (const Vector3d& Phi : kAngles) {
    EXPECT_LT((RotationFromEuler(Phi) - ReferenceRotation(Phi)).norm(), 1e-14);
  }
}

TEST(Rotation, QuaternionTakesBodyToEarth) {
  for (const Vector3d& Phi : kAngles) {
    const Matrix3d R_E_B = QuaternionFromEuler(Phi).toRotationMatrix();
    EXPECT_LT((R_E_B - ReferenceRotation(Phi).transpose()).norm(), 1e-14);
  }
}

TEST(Rotation, EulerAnglesReturn) {
  for (const Vector3d& Phi : kAngles) {
    EXPECT_LT((EulerFromRotation(RotationFromEuler(Phi)) - Phi).norm(), 1e-13);
    EXPECT_LT((EulerFromQuaternion(QuaternionFromEuler(Phi)) - Phi).norm(), 1e-13);
  }
}

TEST(Rotation, ByVectorTurnsByItsNormAboutIt) {
  const Vector3d v(0.3, -0.5, 0.9);
  const Quaterniond reference(AngleAxisd(v.norm(), v / v.norm()));
  EXPECT_LT(RotationByVector(v).angularDistance(reference), 1e-7);
  EXPECT_LT((RotationVector(RotationByVector(v)) - v).norm(), 1e-14);
  EXPECT_EQ(RotationByVector(Vector3d::Zero()).coeffs(), Quaterniond::Identity().coeffs());
}

// Small angles by series, larger ones by sine and cosine.
TEST(Rotation, ByVectorIsExactAtAllAngles) {
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, -0.8, 0.5).normalized();
  for (const double angle : {0.0, 1e-9, 1e-3, 0.063, 0.0633, 0.5, 3.0}) {
    const Eigen::Quaterniond q = RotationByVector(angle * axis);
    EXPECT_NEAR(q.w(), std::cos(0.5 * angle), 2e-16) << angle;
    EXPECT_LT((q.vec() - std::sin(0.5 * angle) * axis).norm(), 2e-16) << angle;
  }
}

TEST(Rotation, NoseUpIsPositiveTheta) {
  const Matrix3d R_B_E = RotationFromEuler(Vector3d(0.0, 0.1, 0.0));
  const Vector3d nose_E = R_B_E.transpose() * Vector3d::UnitX();
  EXPECT_LT(nose_E.z(), 0.0);  // NED: up is negative
}

// eq. 11 against a finite difference of the attitude that turns with constant body rates.
TEST(Rotation, EulerRatesMatchIntegratedBodyRates) {
  const Vector3d Phi(0.3, -0.5, 2.0), omega(0.7, -1.1, 0.4);
  const double dt = 1e-6;
  const auto at = [&](double t) {
    const Quaterniond turn(AngleAxisd(omega.norm() * t, omega.normalized()));
    return EulerFromQuaternion(QuaternionFromEuler(Phi) * turn);
  };
  const Vector3d numeric = (at(dt) - at(-dt)) / (2.0 * dt);
  EXPECT_LT((EulerRateFromBodyRate(Phi) * omega - numeric).norm(), 1e-8);
}

TEST(Rotation, DerivativeAtZeroIsFiniteAndRight) {
  using Jet = ceres::Jet<double, 3>;
  const Vector3<Jet> Phi(Jet(0.0, 0), Jet(0.0, 1), Jet(0.0, 2));
  const Vector3<Jet> turned = RotationFromEuler(Phi) * Vector3<Jet>(Jet(1), Jet(0), Jet(0));
  EXPECT_DOUBLE_EQ(turned[1].v[2], -1.0);  // heading to the right: the north vector lies left
  EXPECT_DOUBLE_EQ(turned[2].v[1], 1.0);   // nose up: the north vector lies below the nose
}

// --- The cubic through position and velocity at both ends of a step.

TEST(CubicPath, ReproducesACubic) {
  const Vector3d c0(3, 4, 5), c1(1, -2, 0.5), c2(0.7, 2, -1), c3(-0.4, 0.3, 0.2);
  const auto place = [&](double t) -> Vector3d { return c0 + t * (c1 + t * (c2 + t * c3)); };
  const auto speed = [&](double t) -> Vector3d { return c1 + t * (2.0 * c2 + 3.0 * t * c3); };
  const double seconds = 1.7;
  const Vector3d p0 = place(0.0), v0 = speed(0.0), p1 = place(seconds), v1 = speed(seconds);
  for (const double u : {-0.2, 0.0, 0.3, 0.8, 1.0}) {
    const double t = u * seconds;
    EXPECT_LT((CubicPath(p0, v0, p1, v1, seconds, u) - place(t)).norm(), 1e-12) << u;
    EXPECT_LT((CubicPathVelocity(p0, v0, p1, v1, seconds, u) - speed(t)).norm(), 1e-12) << u;
  }
}

}  // namespace
}  // namespace trueline
