// The rotor-by-rotor physics against sums by hand.
#include "cost_functions/models/rotor_air.h"

#include <gtest/gtest.h>

#include "tests/prediction/made_run.h"

namespace trueline::testing_prediction {
namespace {

constexpr double kRadius = 0.0275, kDisc = 1.2 * M_PI * kRadius * kRadius;

RotorAirWrench<double> At(const std::vector<double>& c, const Eigen::Vector3d& v,
                          const Eigen::Vector3d& w, const std::array<RotorMotion, 4>& rotors) {
  return RotorAir(SmallVehicle()).WrenchOn(c.data(), v, v, w, rotors.data());
}

std::array<RotorMotion, 4> Hover(double speed = 1700.0) {
  return {{{speed, 0.0}, {speed, 0.0}, {speed, 0.0}, {speed, 0.0}}};
}

TEST(RotorAir, HoversOnThrustAlone) {
  const auto wrench = At(SmallNumbers(), {0, 0, 0}, {0, 0, 0}, Hover());
  const double tip = 1700.0 * kRadius;
  EXPECT_NEAR(wrench.force.z(), 4.0 * kDisc * 0.01725 * tip * tip, 1e-12);
  EXPECT_NEAR(wrench.force.head<2>().norm() + wrench.moment.norm(), 0.0, 1e-12);
}

TEST(RotorAir, ForwardFlightDragsAndPitchesUp) {
  const auto still = At(SmallNumbers(), {0, 0, 0}, {0, 0, 0}, Hover());
  const auto wrench = At(SmallNumbers(), {2, 0, 0}, {0, 0, 0}, Hover());
  const double tip = 1700.0 * kRadius;
  EXPECT_NEAR(wrench.force.x(), -4.0 * kDisc * 0.0346 * tip * 2.0, 1e-12);
  EXPECT_NEAR(wrench.moment.y(), -4.0 * kDisc * kRadius * 0.042 * tip * 2.0, 1e-12);  // nose up
  EXPECT_NEAR(wrench.force.z(), still.force.z(), 1e-12);
}

// A climbing hub loses thrust: pitching is damped without a term of its own.
TEST(RotorAir, HubsDampRates) {
  const double arm = 0.0353, tip = 1700.0 * kRadius;
  const auto wrench = At(SmallNumbers(), {0, 0, 0}, {3.0, 0, 0}, Hover());
  EXPECT_NEAR(wrench.moment.x(), -4.0 * kDisc * 0.033 * tip * 3.0 * arm * arm, 1e-12);
  EXPECT_NEAR(At(SmallNumbers(), {0, 0, 0}, {0, 0, 3.0}, Hover()).moment.z(),
              -4.0 * kDisc * 0.0346 * tip * 3.0 * 2.0 * arm * arm, 1e-12);
}

TEST(RotorAir, RotorsOnTheRightRollLeft) {
  auto rotors = Hover();
  rotors[0].speed = rotors[1].speed = 1750.0;  // both on the right (y < 0)
  EXPECT_LT(At(SmallNumbers(), {0, 0, 0}, {0, 0, 0}, rotors).moment.x(), 0.0);
}

TEST(RotorAir, ReactionFollowsSpinAndAcceleration) {
  auto rotors = Hover();
  rotors[1].speed = 1800.0;         // spin +1
  rotors[1].acceleration = 1000.0;  // rad/s^2
  const auto wrench = At(SmallNumbers(), {0, 0, 0}, {0, 0, 0}, rotors);
  const double scale = kDisc * kRadius * kRadius * kRadius * 0.00243;
  EXPECT_NEAR(wrench.moment.z(), scale * (1800.0 * 1800.0 - 1700.0 * 1700.0) + 2.7e-8 * 1000.0,
              1e-12);
}

TEST(RotorAir, AirAcrossLifts) {
  auto c = SmallNumbers();
  c[RotorAir::kThrustLift] = 0.3;
  c[RotorAir::kThrustLiftAside] = -0.2;
  const double hover = At(c, {0, 0, 0}, {0, 0, 0}, Hover()).force.z();
  EXPECT_NEAR(At(c, {2, 0, 0}, {0, 0, 0}, Hover()).force.z() - hover, 4.0 * kDisc * 0.3 * 4.0,
              1e-12);
  EXPECT_NEAR(At(c, {0, 2, 0}, {0, 0, 0}, Hover()).force.z() - hover, 4.0 * kDisc * 0.1 * 4.0,
              1e-12);
}

TEST(RotorAir, EulerEquation) {
  const auto c = SmallNumbers();
  const Eigen::Vector3d w(1.0, 2.0, 3.0), M(1e-4, 2e-4, 3e-4);
  const Eigen::Vector3d dw = RotorAir::AngularAcceleration(c.data(), M, w);
  const Eigen::Vector3d I(2.7e-5, 3.0e-5, 3.2e-5);
  EXPECT_LT((I.cwiseProduct(dw) + w.cross(I.cwiseProduct(w)) - M).norm(), 1e-15);
}

}  // namespace
}  // namespace trueline::testing_prediction
