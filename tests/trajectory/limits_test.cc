#include "problems/trajectory/limits.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/common/error.h"
#include "problems/trajectory/catalogue.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

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
