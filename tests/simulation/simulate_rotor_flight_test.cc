// Simulated rotor-driven flights: they follow their trajectory, and what they log agrees with the
// estimators' model, which shares no code with the simulator's physics.
#include "problems/simulation/simulate_rotor_flight.h"

#include "problems/common/error.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_step.h"
#include "problems/simulation/simulate.h"
#include "tests/common/matchers.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

RotorSimulation Quiet() {
  RotorSimulation sim{WuestVehicle()};
  sim.noise = {1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9};
  return sim;
}

// Largest distance from the truth of the model's own integration, restarted at the truth every half
// second, m.
double FarthestOpenLoop(const RotorSimulation& sim) {
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(5.0, 3), 1, &truth);
  const RotorData data = MakeRotorData(log, 4, {});
  const RotorAeroModel model = EstimationModel(sim.vehicle);
  const Eigen::Matrix<double, 6, 1> none = Eigen::Matrix<double, 6, 1>::Zero();
  const double dt = 1.0 / sim.imu_rate;
  double farthest = 0.0;
  RotorState x;
  for (std::size_t k = 0; k + 1 < data.imu.size(); ++k) {
    if (k % 125 == 0) x = Joined(truth.states[k], truth.constants);
    farthest = std::max(farthest, (x.segment<3>(4) - truth.states[k].segment<3>(4)).norm());
    RotorMidpointStep(model, data.InputAt((static_cast<double>(k) + 0.5) * dt), none.data(), dt,
                      x.data());
  }
  return farthest;
}

TEST(SimulateRotorFlight, FollowsItsTrajectory) {
  RotorTruth truth;
  SimulateRotorFlight(RotorSimulation{WuestVehicle()}, RandomPath(6.0, 1), 1, &truth);
  EXPECT_LT(truth.path_error_rms, 0.1);
  EXPECT_GT(truth.path_error_rms, 1e-4);  // it flies on noisy sensors
}

// Designs state yaw as the heading of the nose.
TEST(SimulateRotorFlight, FliesTheHeadingOfItsTrajectory) {
  RotorTruth truth;
  const PiecewisePolynomial path = RandomPath(6.0, 1);
  const RotorSimulation sim = Quiet();
  SimulateRotorFlight(sim, path, 1, &truth);
  double squares = 0.0;
  for (std::size_t k = 0; k < truth.states.size(); ++k) {
    const Eigen::Matrix3d R_E_B = AttitudeOf(Joined(truth.states[k], truth.constants));
    const double heading = std::atan2(R_E_B(1, 0), R_E_B(0, 0));
    const double t = path.start() + static_cast<double>(k) / sim.imu_rate;
    squares += std::pow(std::remainder(heading - path.Expand(t, 0)(3, 0), 2.0 * M_PI), 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(truth.states.size())), 0.02);
}

TEST(SimulateRotorFlight, EstimatorsModelPredictsItWithoutDisturbances) {
  EXPECT_LT(FarthestOpenLoop(Quiet()), 2e-3);
}

TEST(SimulateRotorFlight, TrueConstantsHoldDragAndRotorInertia) {
  RotorSimulation sim = Quiet();
  sim.drag = {-0.4, -0.4, -0.2};
  EXPECT_LT(FarthestOpenLoop(sim), 3e-3);
  sim = Quiet();
  sim.rotor_inertia = 1e-5;
  EXPECT_LT(FarthestOpenLoop(sim), 3e-3);
}

TEST(SimulateRotorFlight, EffectsAreNotInTheEstimatorsModel) {
  RotorSimulation sim = Quiet();
  sim.effects = {{"rotor_loss", {{"rotor", 0.0}, {"factor", 0.95}}}};
  EXPECT_GT(FarthestOpenLoop(sim), 5e-2);
}

TEST(SimulateRotorFlight, ImuReadsWhatTheModelSays) {
  const RotorSimulation sim = Quiet();
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(sim, RandomPath(5.0, 2), 1, &truth);
  const RotorData data = MakeRotorData(log, 4, {});
  const RotorAeroModel model = EstimationModel(sim.vehicle);
  for (std::size_t k = 0; k < data.imu.size(); k += 50) {
    const RotorState x = Joined(truth.states[k], truth.constants);
    Eigen::Matrix<double, 6, 1> y;
    model.Imu(x.data(), data.InputAt(data.imu[k].t), y.data());
    EXPECT_LT((y.head<3>() - data.imu[k].accel).norm(), 1e-6);
    EXPECT_LT((y.tail<3>() - data.imu[k].gyro).norm(), 1e-6);
  }
}

// m: of an IMU 0.1 m ahead of the centre of mass, how its sideways reading follows the turn about z
// that its own gyro shows.
double MeasuredArm(double rotor_inertia) {
  RotorSimulation sim = Quiet();
  sim.imu_rate = 1000.0;
  sim.rotor_inertia = rotor_inertia;
  auto& parameters = sim.vehicle.parameters;
  for (int i = 0; i < 3; ++i) {
    parameters[RotorDrivenModel::kImuArm + i] = parameters[RotorDrivenModel::kCentre + i];
  }
  parameters[RotorDrivenModel::kImuArm] += 0.1;
  const std::vector<ImuSample> imu = SimulateRotorFlight(sim, RandomPath(5.0, 2), 1).imu;
  double both = 0.0, squared = 0.0;
  for (std::size_t k = 1; k + 1 < imu.size(); ++k) {
    const double turn = 0.5 * sim.imu_rate * (imu[k + 1].gyro - imu[k - 1].gyro).z();
    const double swing = 0.1 * imu[k].gyro.x() * imu[k].gyro.y();
    both += turn * (imu[k].accel.y() - swing);
    squared += turn * turn;
  }
  return both / squared;
}

TEST(SimulateRotorFlight, ImuFeelsTheTurnThatSpeedingRotorsCause) {
  EXPECT_NEAR(MeasuredArm(0.0), 0.1, 0.003);
  EXPECT_NEAR(MeasuredArm(1e-5), 0.1, 0.003);
}

TEST(SimulateRotorFlight, RatesAndSeeds) {
  const RotorSimulation sim{WuestVehicle()};
  const PiecewisePolynomial path = RandomPath(4.0, 1);
  const FlightLog a = SimulateRotorFlight(sim, path, 7), b = SimulateRotorFlight(sim, path, 7);
  const FlightLog c = SimulateRotorFlight(sim, path, 8);
  EXPECT_EQ(a.imu.size(), 1000u);
  EXPECT_NEAR(static_cast<double>(a.pose.size()), 120.0, 1.0);
  EXPECT_EQ(a.imu[500].accel, b.imu[500].accel);
  EXPECT_NE(a.imu[500].accel, c.imu[500].accel);
  ASSERT_TRUE(a.vehicle.has_value());
  EXPECT_EQ(a.vehicle->rotors.size(), 4u);
}

RotorSimulation Read(const std::string& text) {
  const YamlMap map(YAML::Load(text), "test.yaml", "");
  RotorSimulation sim{WuestVehicle()};
  ReadRotorSimulation(map, &sim);
  return sim;
}

TEST(SimulateRotorFlight, UnknownEffectIsRefused) {
  EXPECT_THROW(Read("effects: [{id: gremlins, k: 1.0}]"), InputError);
  EXPECT_THROW(Read("effects: [{id: rotor_loss, rotor: 4, factor: 0.9}]"), InputError);
  EXPECT_THROW(Read("effects: [{id: fix_scale, s: 0.1}]"), InputError);  // it has no fixes
}

TEST(SimulateRotorFlight, TruthFileStatesAllThatWasFlown) {
  const RotorSimulation sim = Read(
      "drag: [-0.3, -0.2, -0.1]\n"
      "rotor_inertia: 5.0e-6\n"
      "effects: [{id: motor_lag, tau: 0.03}, {id: rotor_inflow, k: 1.0e-5}]\n"
      "forces: [{along: east, goes_with: yaw rate * sink rate, place: [8, 2], radius: 2, size: "
      "1.5},"
      " {id: term, where: force_x, with: q, size: 0.1, unit: m/s^2 for each rad/s}]\n");
  RotorTruth truth;
  truth.constants = TrueConstants(sim);
  const YAML::Node file = YAML::Load(TruthYaml(truth, sim, 1, "a.yaml"));
  const auto value = [&](const char* name) {
    return file["parameters"][name]["value"].as<double>();
  };
  EXPECT_EQ(value("m"), sim.vehicle.parameters[RotorDrivenModel::kMass]);
  EXPECT_EQ(value("K_x"), -0.3);
  EXPECT_EQ(value("K_z"), -0.1);
  EXPECT_EQ(value("J_r"), 5e-6);
  EXPECT_EQ(value("motor_lag"), 0.03);
  EXPECT_EQ(file["motor_lag"].as<double>(), 0.03);
  YAML::Node hidden;
  hidden["effects"] = file["effects"];
  hidden["forces"] = file["forces"];
  const RotorSimulation again = Read(YAML::Dump(hidden));
  ASSERT_EQ(again.effects.size(), 3u);
  EXPECT_EQ(again.effects[1].id, "rotor_inflow");
  EXPECT_EQ(again.effects[1].values, sim.effects[1].values);
  ASSERT_EQ(again.forces.size(), 1u);
  EXPECT_EQ(again.forces[0].axis, sim.forces[0].axis);
  EXPECT_EQ(again.forces[0].factors, sim.forces[0].factors);
  EXPECT_EQ(again.forces[0].place, sim.forces[0].place);
  EXPECT_EQ(again.forces[0].radius, 2.0);
  EXPECT_EQ(again.forces[0].size, 1.5);
  EXPECT_EQ(again.effects[2]["size"], 0.1);  // the term of `forces`
}

std::string Warning(double amplitude) {
  YAML::Node file =
      YAML::LoadFile(std::string(TRUELINE_TEST_SOURCE_DIR) + "/config/rotors/random.yaml");
  file["trajectory"] = YAML::Load("{kind: lissajous, duration: 5, frequency: [0, 0, 1.2, 0]}");
  file["trajectory"]["amplitude"] = std::vector<double>{0.0, 0.0, amplitude, 0.0};
  return ReadRotorFlight(YamlMap(file, "flight.yaml", "")).warning;
}

TEST(RotorFlightConfig, WarnsOfAPathThatBreaksTheLimits) {
  EXPECT_EQ(Warning(0.02), "");
  EXPECT_THAT(Warning(0.4), HasSubstr("flight.yaml: the trajectory breaks the limit on"));
}

TEST(DrawGuess, LeavesKnownConstantsAtTheirStatedValues) {
  const RotorSimulation sim = Read("drag: [-0.6, -0.6, -0.3]");
  RotorPrior prior = PriorFromVehicle(sim.vehicle);
  const int K_x = FindRotorConstant("K_x"), K_y = FindRotorConstant("K_y");
  prior.sigma[K_x] = 1e-3;
  prior.mean[K_y] = -0.5;
  const RotorPrior guess = DrawGuess(prior, TrueConstants(sim), 1);
  EXPECT_NEAR(guess.mean[K_x], -0.6, 0.01);
  EXPECT_EQ(guess.mean[K_y], -0.5);
}

}  // namespace
}  // namespace trueline
