#include "cost_functions/models/window_prediction.h"

#include <gtest/gtest.h>

namespace trueline {
namespace {

Eigen::Vector4d Turned(double roll, double heading) {
  const Eigen::Quaterniond q = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  return {q.w(), q.x(), q.y(), q.z()};
}

// A quaternion and its negative are one attitude.
TEST(WindowPrediction, AnglesDoNotDependOnTheSignOfTheQuaternion) {
  for (const double heading : {-0.4, 0.0, 0.3}) {
    const Eigen::Vector4d q = Turned(0.2, heading);
    const Eigen::Vector3d angles = WindowPrediction::AttitudeAngles(q);
    EXPECT_LT((WindowPrediction::AttitudeAngles(-q) - angles).norm(), 1e-12) << heading;
    EXPECT_NEAR(angles.x(), 0.2, 1e-9);
  }
}

// A heading far from zero is flown on purpose: nothing holds it.
TEST(WindowPrediction, AHeadingFarFromZeroIsNotHeld) {
  for (const double heading : {1.6, 3.1, -2.0}) {
    EXPECT_EQ(WindowPrediction::AttitudeAngles(Turned(0.2, heading)).z(), 0.0) << heading;
  }
}

}  // namespace
}  // namespace trueline
