#include "problems/rotor/smooth_speeds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/calibration/rotor_calibration.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

using Speeds = std::vector<std::vector<double>>;

struct Series {
  std::vector<double> t;
  Speeds speeds;
};

// Thrust changes all speeds by up to 150 rad/s, a moment their difference by up to 15 rad/s.
Series Measured(double noise, int count = 2000) {
  Random random(4, "speeds");
  Series series;
  for (int i = 0; i < count; ++i) {
    const double t = 0.004 * i;
    const double thrust = 900.0 + 150.0 * std::sin(3.0 * t), moment = 15.0 * std::sin(11.0 * t);
    series.t.push_back(t);
    series.speeds.push_back(
        {thrust + moment + noise * random.Normal(), thrust - moment + noise * random.Normal()});
  }
  return series;
}

double RootMeanSquare(const Speeds& a, const Speeds& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t r = 0; r < a[i].size(); ++r) sum += std::pow(a[i][r] - b[i][r], 2);
  }
  return std::sqrt(sum / static_cast<double>(a.size() * a[0].size()));
}

TEST(SmoothSpeeds, LearnsTheNoiseAndRemovesMostOfIt) {
  const Series truth = Measured(0.0), measured = Measured(10.0);
  const SmoothedSpeeds smoothed = SmoothSpeeds(measured.t, measured.speeds);
  EXPECT_NEAR(smoothed.sigma, 10.0, 0.7);
  EXPECT_LT(RootMeanSquare(smoothed.speeds, truth.speeds), 3.0);
  EXPECT_GT(RootMeanSquare(measured.speeds, truth.speeds), 9.0);
}

TEST(SmoothSpeeds, LeavesExactSpeedsAsTheyAre) {
  const Series exact = Measured(0.0);
  EXPECT_LT(RootMeanSquare(SmoothSpeeds(exact.t, exact.speeds).speeds, exact.speeds), 0.05);
  const Speeds still(100, {800.0, 900.0});
  const SmoothedSpeeds same =
      SmoothSpeeds(std::vector<double>(exact.t.begin(), exact.t.begin() + 100), still);
  EXPECT_EQ(same.speeds, still);
  EXPECT_EQ(same.sigma, 0.0);
}

TEST(SmoothSpeeds, KeepsFewSamples) {
  const Series few = Measured(10.0, 5);
  EXPECT_EQ(SmoothSpeeds(few.t, few.speeds).speeds, few.speeds);
}

// Noise on the speeds is no moment of inertia.
TEST(RotorCalibration, SlowInertiaFromNoisySpeeds) {
  RotorSimulation sim(WuestVehicle());
  sim.speed_noise = 0.05;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(14.0, 4), 3);
  RotorCalibrationOptions options(WuestVehicle());
  options.prior = DrawnPrior(WuestVehicle(), 2);
  const int I_x = FindRotorConstant("I_x");
  const double truth = PriorFromVehicle(WuestVehicle()).mean[I_x];
  const auto share_off = [&](bool smooth) {
    options.data.smooth_rotors = smooth;
    return CalibrateRotors(log, options).batch.mean[I_x] / truth - 1.0;
  };
  const double exact = share_off(false), smoothed = share_off(true);
  EXPECT_GT(exact, 0.3);
  EXPECT_LT(std::abs(smoothed), 0.5 * exact);
}

}  // namespace
}  // namespace trueline
