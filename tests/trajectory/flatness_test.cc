#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "problems/common/error.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"
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

FlatMatrix RandomControl(int count) {
  std::srand(3);
  return FlatMatrix::Random(kFlatOutputs, count);
}

TEST(PiecewisePolynomial, CubicSplineHasItsTextbookBasis) {
  Eigen::Matrix4d want;  // columns of control points, rows of powers
  want << 1, 4, 1, 0, -3, 0, 3, 0, 3, -6, 3, 0, -1, 3, -3, 1;
  EXPECT_LT((SplineBasis(3, 0.0, 3) - want / 6.0).norm(), 1e-14);
}

TEST(PiecewisePolynomial, SplineJoinsSmoothly) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(15), 7, 4.0);
  ASSERT_EQ(p.num_pieces(), 8);
  for (int i = 1; i < p.num_pieces(); ++i) {
    const double t = p.breaks()[i];
    const FlatMatrix before = p.ExpandPiece(i - 1, t, 6), after = p.ExpandPiece(i, t, 6);
    EXPECT_LT((before - after).norm(), 1e-10 * after.norm());
  }
}

TEST(PiecewisePolynomial, RepeatedControlPointsRestAtTheEnds) {
  FlatMatrix control = RandomControl(20);
  for (int i = 1; i < 7; ++i) {
    control.col(i) = control.col(0);
    control.col(19 - i) = control.col(19);
  }
  const auto p = PiecewisePolynomial::FromSpline(control, 7, 4.0);
  EXPECT_LT(p.Expand(p.start(), 6).rightCols(6).norm(), 1e-10);
  EXPECT_LT(p.ExpandPiece(p.num_pieces() - 1, p.end(), 6).rightCols(6).norm(), 1e-8);
  EXPECT_LT((p.Expand(0.0, 0) - control.col(0)).norm(), 1e-13);
}

TEST(PiecewisePolynomial, ExpansionPredictsTheValueNearby) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(12), 7, 5.0);
  const FlatMatrix at = p.Expand(1.3, 7);
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int j = 7; j >= 0; --j) sum = sum * 0.21 + at.col(j);
  EXPECT_LT((sum - p.Expand(1.51, 0)).norm(), 1e-12);
}

TEST(PiecewisePolynomial, HermitePiecesFollowASine) {
  const auto sine = [](double t) {
    FlatMatrix c(kFlatOutputs, 6);
    double factorial = 1.0;
    for (int j = 0; j < 6; ++j) {
      if (j > 0) factorial *= j;
      c.col(j).setConstant(std::sin(t + j * M_PI / 2) / factorial);
    }
    return c;
  };
  const auto p = PiecewisePolynomial::FromExpansions(sine, 1.5, 3);
  for (double t = 0.0; t < 1.5; t += 0.07) {
    EXPECT_NEAR(p.Expand(t, 0)(1, 0), std::sin(t), 1e-13);
    EXPECT_NEAR(p.Expand(t, 4)(2, 4) * 24.0, std::sin(t), 1e-6);
  }
}

TEST(PiecewisePolynomial, ScalingKeepsTheStart) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(12), 7, 5.0);
  const auto half = p.Scaled(0.5);
  const Eigen::Vector4d start = p.Expand(0.0, 0), there = p.Expand(2.0, 0);
  EXPECT_LT((half.Expand(0.0, 0) - start).norm(), 1e-14);
  EXPECT_LT((half.Expand(2.0, 0) - (start + 0.5 * (there - start))).norm(), 1e-13);
}

RotorFlight Fly(const Lissajous& figure, double duration = 4.0) {
  return {{TestQuadrotor(), TestNominal()}, LissajousPath(figure, duration)};
}

TEST(Limits, HoverUsesNothingButRotorSpeed) {
  const LimitUse use = CheckLimits(Fly({}), FlightLimits{}, 0.1);
  EXPECT_EQ(use.travel, 0.0);
  EXPECT_EQ(use.rate, 0.0);
  EXPECT_EQ(use.tilt, 0.0);
  EXPECT_NEAR(use.max_speed * 30 / M_PI, 12300, 300);
}

// x = a sin(w t): the largest tilt is atan(a w^2 / g), the travel 2 a.
TEST(Limits, TiltAndTravelOfAShuttleAreThoseByHand) {
  Lissajous shuttle;
  shuttle.amplitude[0] = 0.3;
  shuttle.frequency[0] = 1.0;
  const LimitUse use = CheckLimits(Fly(shuttle), FlightLimits{}, 0.001);
  EXPECT_NEAR(use.travel, 0.6, 1e-5);
  EXPECT_NEAR(use.tilt, std::atan(0.3 * 4 * M_PI * M_PI / 9.81), 1e-5);
}

// A shuttle along x tilts by pitch alone, along y by roll alone.
TEST(Limits, RollAndPitchAreLimitedEachByItself) {
  const double tilt = std::atan(0.3 * 4 * M_PI * M_PI / 9.81);
  for (const int axis : {0, 1}) {
    Lissajous shuttle;
    shuttle.amplitude[axis] = 0.3;
    shuttle.frequency[axis] = 1.0;
    FlightLimits limits;
    limits.tilt = INFINITY;
    (axis == 0 ? limits.roll : limits.pitch) = 0.1;  // of the other angle
    const LimitUse free = CheckLimits(Fly(shuttle), limits, 0.001);
    EXPECT_NEAR(axis == 0 ? free.pitch : free.roll, tilt, 1e-5);
    EXPECT_NEAR(axis == 0 ? free.roll : free.pitch, 0.0, 1e-9);
    (axis == 0 ? limits.pitch : limits.roll) = 0.5 * tilt;
    const LimitUse use = CheckLimits(Fly(shuttle), limits, 0.001);
    EXPECT_EQ(use.binding, axis == 0 ? "pitch" : "roll");
    EXPECT_NEAR(use.worst, 2.0, 1e-4);
  }
}

TEST(Limits, YawRateIsTheRateOfAFlatTurn) {
  Lissajous turn;
  turn.amplitude[3] = 0.5;
  turn.frequency[3] = 0.5;
  EXPECT_NEAR(CheckLimits(Fly(turn), FlightLimits{}, 0.001).rate, 0.5 * M_PI, 1e-5);
}

TEST(Limits, RandomFlightsAreBroughtJustWithinAllLimits) {
  const SplineShape shape{5.0, 10, 7};
  Random random(4);
  for (int i = 0; i < 5; ++i) {
    const auto path = PiecewisePolynomial::FromSpline(
        RestToRest(shape, RandomControl(shape, 3.0, 3.0, &random)), shape.degree, shape.duration);
    const auto fitted =
        ScaledToLimits({TestQuadrotor(), TestNominal()}, path, FlightLimits{}, 0.01, 1.0);
    const LimitUse use =
        CheckLimits(RotorFlight({TestQuadrotor(), TestNominal()}, fitted), FlightLimits{}, 0.01);
    EXPECT_LE(use.worst, 1.0);
    EXPECT_GT(use.worst, 0.97);
    EXPECT_FALSE(use.binding.empty());
  }
}

TEST(Limits, VehicleTooHeavyToHoverIsRefused) {
  std::vector<double> heavy = TestNominal();
  heavy[RotorDrivenModel::kMass] = 2.0;
  EXPECT_THROW(
      ScaledToLimits({TestQuadrotor(), heavy}, LissajousPath({}, 2.0), FlightLimits{}, 0.1, 1.0),
      InputError);
}

TEST(Catalogue, ManoeuvresKeepToTheLimits) {
  for (const Manoeuvre& manoeuvre : PlainManoeuvres()) {
    EXPECT_LE(CheckLimits(Fly(manoeuvre.figure, 10.0), FlightLimits{}, 0.01).worst, 1.0)
        << manoeuvre.name;
  }
}

TEST(Catalogue, LissajousIsASine) {
  Lissajous figure;
  figure.amplitude << 0.3, 0.2, 0.1, 1.0;
  figure.frequency << 0.5, 0.7, 1.1, 0.3;
  figure.phase << 0.1, 0.2, 0.3, 0.4;
  const auto path = LissajousPath(figure, 5.0);
  for (double t = 0.0; t < 5.0; t += 0.13) {
    EXPECT_NEAR(path.Expand(t, 0)(2, 0), 0.1 * std::sin(2 * M_PI * 1.1 * t + 0.3), 1e-9);
  }
}

}  // namespace
}  // namespace trueline
