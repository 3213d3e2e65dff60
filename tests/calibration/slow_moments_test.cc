// Inertia of a vehicle whose autopilot holds against moments that no log shows, and moments of the
// air on rotors that the simulator computes by blade elements.
#include <gtest/gtest.h>

#include <cmath>

#include "problems/calibration/learn_rotor_noise.h"
#include "problems/rotor/rotor_batch.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

RotorBatchResult Fitted(const RotorSimulation& sim, const RotorData& data, const RotorNoise& noise,
                        const RotorPrior& prior) {
  RotorBatchOptions options;
  options.noise = noise;
  options.prior = prior;
  return RunRotorBatch(EstimationModel(sim.vehicle), data, options);
}

// Eddies are no Gauss-Markov process; flights differ by seed.
TEST(SlowMoments, DoNotInflateInertiaOnceTheDriftIsLearned) {
  constexpr int kFlights = 3;
  double white_ratio = 0.0, learned_ratio = 0.0;
  for (int seed = 1; seed <= kFlights; ++seed) {
    RotorSimulation sim(WuestVehicle());
    sim.slow_moments = 5.0;
    RotorTruth truth;
    const FlightLog log = SimulateRotorFlight(sim, RandomPath(10.0, seed), seed, &truth);
    const RotorData data = MakeRotorData(log, 4, {});
    RotorEkfOptions filter;
    filter.noise = sim.noise;
    filter.prior = DrawnPrior(WuestVehicle(), seed);
    const RotorAeroModel model = EstimationModel(sim.vehicle);
    const RotorNoise learned = LearnRotorNoise(model, data, filter, sim.noise).noise;
    EXPECT_GT(learned.angular_drift, 2.0);
    RotorNoise white = learned;
    white.angular_drift = 0.0;
    white.angular_density = 5.0;  // what is left to explain the eddies
    const RotorBatchResult without = Fitted(sim, data, white, filter.prior);
    const RotorBatchResult with = Fitted(sim, data, learned, filter.prior);
    for (int i = kInertiaConstants; i < kInertiaConstants + 2; ++i) {
      EXPECT_NEAR(with.mean[i], truth.constants[i], 4.0 * with.Sigma()[i]);
      white_ratio += without.mean[i] / truth.constants[i] / (2.0 * kFlights);
      learned_ratio += with.mean[i] / truth.constants[i] / (2.0 * kFlights);
    }
  }
  EXPECT_NEAR(learned_ratio, 1.0, 0.05);
  EXPECT_GT(std::abs(white_ratio - 1.0), 2.0 * std::abs(learned_ratio - 1.0));
}

TEST(SlowMoments, NoDriftIsLearnedOnAFlightWithout) {
  const RotorSimulation sim(WuestVehicle());
  const RotorData data = MakeRotorData(SimulateRotorFlight(sim, RandomPath(8.0, 4), 3), 4, {});
  RotorEkfOptions filter;
  filter.noise = sim.noise;
  filter.prior = DrawnPrior(WuestVehicle(), 2);
  const LearnedNoise learned =
      LearnRotorNoise(EstimationModel(sim.vehicle), data, filter, sim.noise);
  EXPECT_LT(learned.noise.angular_drift, 0.5);
}

// Blade elements brake turns and flap in the wind of flight; no constant of theirs is the
// estimator's.
TEST(AirTurn, DampingOfBladesIsFoundAndPredictsBetter) {
  RotorSimulation sim(WuestVehicle());
  sim.blades.emplace();
  const RotorData data = MakeRotorData(SimulateRotorFlight(sim, RandomPath(12.0, 2), 5), 4, {});
  RotorPrior plain = PriorFromVehicle(WuestVehicle());
  for (const char* name : {"K_x", "K_y", "K_z"}) plain.sigma[FindRotorConstant(name)] = 0.5;
  RotorPrior free = plain;
  for (const char* name : {"L_p", "M_q", "N_r"}) free.sigma[FindRotorConstant(name)] = 20.0;
  for (const char* name : {"L_v", "M_u"}) free.sigma[FindRotorConstant(name)] = 10.0;
  const RotorBatchResult without = Fitted(sim, data, sim.noise, plain);
  const RotorBatchResult with = Fitted(sim, data, sim.noise, free);
  for (const char* name : {"L_p", "M_q"}) {
    const int i = FindRotorConstant(name);
    EXPECT_LT(with.mean[i], -5.0 * with.Sigma()[i]) << name;
  }
  EXPECT_GT(with.log_evidence, without.log_evidence + 50.0);
}

// Rotors of 2e-5 kg m^2 turn the vehicle against themselves as they speed up, as the airframe of
// the simulator computes by their angular momentum.
TEST(RotorInertia, IsFoundAndRightsTheYaw) {
  RotorSimulation sim(WuestVehicle());
  sim.rotor_inertia = 2e-5;
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(12.0, 2), 5, &truth);
  const RotorData data = MakeRotorData(log, 4, {});
  const RotorPrior plain = PriorFromVehicle(WuestVehicle());
  RotorPrior free = plain;
  const int at = FindRotorConstant("J_r"), yaw = FindRotorConstant("I_z");
  free.sigma[at] = 5e-5;
  const RotorBatchResult without = Fitted(sim, data, sim.noise, plain);
  const RotorBatchResult with = Fitted(sim, data, sim.noise, free);
  EXPECT_NEAR(with.mean[at], 2e-5, 4.0 * with.Sigma()[at]);
  EXPECT_LT(with.Sigma()[at], 3e-6);
  EXPECT_NEAR(with.mean[yaw], truth.constants[yaw], 4.0 * with.Sigma()[yaw]);
  EXPECT_GT(with.log_evidence, without.log_evidence + 50.0);
}

}  // namespace
}  // namespace trueline
