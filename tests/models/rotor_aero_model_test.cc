#include "cost_functions/models/rotor_aero_model.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// A pose that is late was measured where the sensor was then: at the end of an arm that turns.
TEST(RotorAeroModel, ALatePoseIsWhereTheSensorWas) {
  using Model = RotorAeroModel;
  const Quaterniond q = Quaterniond(0.9, -0.1, 0.3, 0.2).normalized();
  const Vector3d p(1.0, 2.0, -3.0), v(4.0, -2.0, 0.5), w(3.0, -5.0, 1.5), arm(0.3, -0.1, 0.05);
  const double delay = 1e-4;
  std::vector<double> x(Model::kStates, 0.0);
  x[0] = q.w(), x[1] = q.x(), x[2] = q.y(), x[3] = q.z();
  Vector3d::Map(&x[Model::Base::kPosition]) = p;
  Vector3d::Map(&x[Model::Base::kVelocity]) = v;
  Vector3d::Map(&x[Model::Base::kRate]) = w;
  Vector3d::Map(&x[Model::Base::kPoseArm]) = arm;
  x[Model::kPoseDelay] = delay;
  const Quaterniond q_then = q * Quaterniond(Eigen::AngleAxisd(-delay * w.norm(), w.normalized()));
  Vector3d position;
  Model::Position(x.data(), position.data());
  EXPECT_LT((position - (p - delay * v + q_then * arm)).norm(), 1e-7);
  const Vec4<double> attitude = Model::Attitude(x.data());
  EXPECT_LT((attitude - Vec4<double>(q_then.w(), q_then.x(), q_then.y(), q_then.z())).norm(), 1e-6);
}

}  // namespace
}  // namespace trueline
