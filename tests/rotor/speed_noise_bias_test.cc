#include <gtest/gtest.h>

#include <cmath>

#include "problems/calibration/rotor_calibration.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

constexpr int kFlights = 8;

struct Fit {
  RotorBatchResult batch, corrected;
  RotorConstants bias;
};

Fit FitTo(const RotorSimulation& sim, std::uint64_t seed) {
  const Flown flown = Fly(sim, RandomPath(10.0, seed), seed);
  const RotorAeroModel model = ModelOf(sim);
  const RotorBatchOptions options{
      sim.noise, DrawGuess(PriorFromVehicle(sim.vehicle), flown.truth.constants, seed)};
  Fit fit;
  fit.batch = RunRotorBatch(model, flown.data, options);
  fit.corrected = WithoutSpeedNoiseBias(model, flown.data, options, fit.batch, &fit.bias);
  return fit;
}

RotorSimulation QuietSensors(double speed_noise) {
  RotorSimulation sim(WuestVehicle());
  sim.noise.accel = 0.4, sim.noise.gyro = 0.03, sim.noise.position = 0.003;
  sim.noise.attitude = 0.005, sim.noise.force_density = 0.05, sim.noise.angular_density = 0.3;
  sim.speed_noise = speed_noise;
  return sim;
}

// Two axes of each flight. A bias is that of many flights: one has the error of its noise, too.
TEST(SpeedNoiseBias, IsNoMomentOfInertia) {
  const RotorSimulation sim = QuietSensors(0.02);
  const RotorConstants truth = PriorFromVehicle(sim.vehicle).mean;
  double before = 0.0, after = 0.0;
  for (int i = 0; i < kFlights; ++i) {
    const Fit fit = FitTo(sim, 31 + i);
    for (const char* name : {"I_x", "I_y"}) {
      const int k = FindRotorConstant(name);
      before += (fit.batch.mean[k] / truth[k] - 1.0) / (2 * kFlights);
      after += (fit.corrected.mean[k] / truth[k] - 1.0) / (2 * kFlights);
      EXPECT_GT(fit.bias[k], 0.0);
    }
  }
  EXPECT_GT(before, 0.02);
  EXPECT_LT(std::abs(after), 0.5 * before);
}

TEST(SpeedNoiseBias, ExactSpeedsHaveNone) {
  const Fit fit = FitTo(QuietSensors(0.0), 1);
  EXPECT_EQ(fit.corrected.mean, fit.batch.mean);
  EXPECT_TRUE(fit.bias.isZero(0.0));
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
