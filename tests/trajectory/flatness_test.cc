#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "problems/common/error.h"
#include "problems/trajectory/piecewise_polynomial.h"
#include "problems/trajectory/rotor_flight.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

using Series = Taylor<double, 8>;

PiecewisePolynomial SomeFlight() {
  std::srand(5);
  FlatMatrix control = 0.4 * FlatMatrix::Random(kFlatOutputs, 17);
  control.row(3) *= 4.0;
  return PiecewisePolynomial::FromSpline(control, 7, 5.0);
}

FlatState<Series> At(const FlatVehicle& vehicle, double t) {
  return StateFromFlat<Series>(vehicle, FlatSeries<Series>(SomeFlight().Expand(t, 7)));
}

TEST(Flatness, ModelDrivenByTheRotorSpeedsFollowsTheTrajectory) {
  const RotorDrivenModel model = TestQuadrotor();
  const FlatVehicle vehicle = MakeFlatVehicle(model, TestNominal());
  for (const double t : {0.1, 1.7, 3.3}) {
    const FlatState<Series> flat = At(vehicle, t);
    std::vector<double> x = TestNominal(), u;
    for (int i = 0; i < 4; ++i) x[i] = flat.q[i][0], u.push_back(flat.u[i][0]);
    for (int i = 0; i < 3; ++i) {
      x[RotorDrivenModel::kVelocity + i] = flat.v[i][0];
      x[RotorDrivenModel::kRate + i] = flat.w[i][0];
    }
    double dx[RotorDrivenModel::kMoving];
    model.Derivative(x.data(), u.data(), dx);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(dx[RotorDrivenModel::kVelocity + i], flat.v[i][1], 1e-10);
      EXPECT_NEAR(dx[RotorDrivenModel::kRate + i], flat.w[i][1], 1e-8);
    }
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(dx[i], flat.q[i][1], 1e-10);
  }
}

// Attitude from rotation matrices: body z opposite to the thrust, body x level with the heading.
TEST(Flatness, AttitudeHasThrustAndHeadingAsAsked) {
  const FlatVehicle vehicle = MakeFlatVehicle(TestQuadrotor(), TestNominal());
  for (const double t : {0.4, 2.2, 4.9}) {
    const FlatMatrix flat = SomeFlight().Expand(t, 2);
    const Eigen::Vector3d pull = Eigen::Vector3d(0, 0, 9.81) - 2.0 * flat.col(2).head<3>();
    const double yaw = flat(3, 0);
    Eigen::Matrix3d R;
    R.col(2) = pull.normalized();
    R.col(0) = Eigen::Vector3d(-std::sin(yaw), std::cos(yaw), 0.0).cross(R.col(2)).normalized();
    R.col(1) = R.col(2).cross(R.col(0));
    EXPECT_NEAR(std::atan2(R(1, 0), R(0, 0)), std::remainder(yaw, 2 * M_PI), 1e-12);
    const auto q = At(vehicle, t).q;
    const Eigen::Quaterniond have(q[0][0], q[1][0], q[2][0], q[3][0]);
    EXPECT_NEAR(have.norm(), 1.0, 1e-13);
    EXPECT_LT((have.toRotationMatrix() - R).norm(), 1e-12);
    EXPECT_NEAR(At(vehicle, t).cos_tilt[0], R(2, 2), 1e-13);
  }
}

TEST(Flatness, SeriesPredictRotorSpeedsNearby) {
  const FlatVehicle vehicle = MakeFlatVehicle(TestQuadrotor(), TestNominal());
  const auto now = At(vehicle, 2.6), later = At(vehicle, 2.61);
  for (int i = 0; i < 4; ++i) {
    double sum = 0.0;
    for (int j = 3; j >= 0; --j) sum = sum * 0.01 + now.u[i][j];
    EXPECT_NEAR(sum / later.u[i][0], 1.0, 1e-6);
  }
}

TEST(Flatness, HoverNeedsTheSpeedsOfTheWeight) {
  const FlatVehicle vehicle = MakeFlatVehicle(TestQuadrotor(), TestNominal());
  const auto state = StateFromFlat<Series>(vehicle, FlatSeries<Series>(FlatMatrix::Zero(4, 6)));
  double sum = 0.0;
  for (const Series& u : state.u) sum += 3.8108e-7 * u[0];
  EXPECT_NEAR(sum, 0.2463 * 9.81, 1e-12);
  EXPECT_NEAR(std::sqrt(state.u[0][0]) * 30.0 / M_PI, 12000.0, 400.0);  // the papers' hover speed
}

TEST(Flatness, TiltedRotorsAreRefused) {
  std::vector<Rotor> rotors = TestQuadrotor().rotors();
  rotors[2].axis = Eigen::Vector3d(0.1, 0.0, -1.0).normalized();
  EXPECT_THROW(MakeFlatVehicle(RotorDrivenModel(rotors), TestNominal()), InputError);
}

}  // namespace
}  // namespace trueline
