// The effects of the estimators' model against the simulator's own physics of the same ids.
#include <gtest/gtest.h>

#include "problems/effects/declaration.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_step.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

RotorSimulation QuietAboveTheFloor() {
  RotorSimulation sim(WuestVehicle());
  sim.noise = {1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9};
  sim.height = 1.2;
  return sim;
}

struct Misses {
  double farthest = 0.0;  // m, of the model restarted at the truth every half second
  double accel = 0.0;     // m/s^2, largest error of a reading
};

Misses MissesOf(const RotorSimulation& sim, const std::vector<Effect>& effects) {
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(6.0, 3), 1, &truth);
  const RotorExtension extension = RotorExtensionOf(effects);
  RotorDataOptions streams;
  streams.motor_lag = extension.motor_lag;
  const RotorData data = MakeRotorData(log, 4, streams);
  const RotorAeroModel model(sim.vehicle.model.rotors(), sim.vehicle.model.gravity(),
                             extension.effects);
  const RotorConstants constants = truth.constants + extension.added;
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  const double dt = 1.0 / sim.imu_rate;
  Misses misses;
  RotorState x;
  for (std::size_t k = 0; k + 1 < data.imu.size(); ++k) {
    if (k % 125 == 0) x = Joined(truth.states[k], constants);
    misses.farthest =
        std::max(misses.farthest, (x.segment<3>(4) - truth.states[k].segment<3>(4)).norm());
    Eigen::Matrix<double, 6, 1> y;
    const RotorState now = Joined(truth.states[k], constants);
    model.Imu(now.data(), data.InputAt(data.imu[k].t), y.data());
    misses.accel = std::max(misses.accel, (y.head<3>() - data.imu[k].accel).norm());
    RotorMidpointStep(model, data.InputAt((static_cast<double>(k) + 0.5) * dt), none.data(), dt,
                      x.data());
  }
  return misses;
}

class RotorEffectsTest : public testing::TestWithParam<Effect> {};

TEST_P(RotorEffectsTest, ModelPredictsWhatTheSimulatorFlies) {
  RotorSimulation sim = QuietAboveTheFloor();
  const Effect& effect = GetParam();
  sim.effects = {{effect.id, effect.values}};
  sim.log_commands = effect.id == "motor_lag";
  const Misses with = MissesOf(sim, {effect}), without = MissesOf(sim, {});
  EXPECT_LT(with.farthest, 2e-3);
  EXPECT_GT(without.farthest, 2.0 * with.farthest);
  EXPECT_LT(with.accel, effect.id == "motor_lag" ? 0.1 : 1e-6);  // commands are held between rows
  EXPECT_GT(without.accel, 0.01);
}

TEST(RotorExtension, StepsOfTheLoadAddUp) {
  const RotorEffects effects =
      RotorExtensionOf({{"payload_step", {{"t_step", 2.0}, {"mass", 0.02}}},
                        {"payload_step", {{"t_step", 1.0}, {"mass", -0.05}}},
                        {"com_step", {{"t_step", 1.5}, {"dx", 0.005}, {"dy", 0.0}}},
                        {"com_step", {{"t_step", 3.0}, {"dx", 0.0}, {"dy", -0.004}}}})
          .effects;
  EXPECT_EQ(effects.AddedMass(0.5), 0.0);
  EXPECT_EQ(effects.AddedMass(1.5), -0.05);
  EXPECT_NEAR(effects.AddedMass(2.5), -0.03, 1e-15);
  EXPECT_EQ(effects.CentreShift(1.0), Eigen::Vector3d::Zero());
  EXPECT_EQ(effects.CentreShift(2.5), Eigen::Vector3d(0.005, 0.0, 0.0));
  EXPECT_EQ(effects.CentreShift(3.5), Eigen::Vector3d(0.005, -0.004, 0.0));
}

TEST(RotorExtension, EffectsOfOneKindAddUp) {
  const RotorEffects effects = RotorExtensionOf({{"rotor_loss", {{"rotor", 0}, {"factor", 0.8}}},
                                                 {"rotor_loss", {{"rotor", 2}, {"factor", 0.9}}},
                                                 {"rotor_tilt", {{"roll", 0.03}}},
                                                 {"rotor_tilt", {{"roll", 0.01}}}})
                                   .effects;
  EXPECT_EQ(effects.ThrustFactor(0, 0.0), 0.8);
  EXPECT_EQ(effects.ThrustFactor(1, 0.0), 1.0);
  EXPECT_EQ(effects.ThrustFactor(2, 0.0), 0.9);
  EXPECT_DOUBLE_EQ(effects.tilt_roll, 0.04);
}

INSTANTIATE_TEST_SUITE_P(
    All, RotorEffectsTest,
    testing::Values(Effect{"linear_drag", {{"K_x", -0.4}, {"K_y", -0.3}, {"K_z", -0.2}}},
                    Effect{"thrust_sag", {{"d", 0.01}}},
                    Effect{"rotor_loss", {{"rotor", 2}, {"factor", 0.93}}},
                    Effect{"rotor_inflow", {{"k", 1e-4}}},
                    Effect{"rotor_speed_drag", {{"k", 1e-4}}}, Effect{"motor_lag", {{"tau", 0.03}}},
                    Effect{"translational_lift", {{"k", 0.3}}},
                    Effect{"body_drag", {{"c_x", 0.3}, {"c_y", 0.2}, {"c_z", 0.1}}},
                    Effect{"air_moment", {{"roll", 3e-4}, {"pitch", 5e-4}}},
                    Effect{"ground_effect", {{"k", 0.2}}},
                    Effect{"payload_step", {{"t_step", 2.0}, {"mass", 0.02}}},
                    Effect{"com_step", {{"t_step", 2.0}, {"dx", 0.005}, {"dy", -0.004}}},
                    Effect{"rotor_tilt", {{"roll", 0.03}, {"pitch", -0.05}}}),
    [](const auto& tested) { return tested.param.id; });

}  // namespace
}  // namespace trueline
