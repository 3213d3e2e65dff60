// The flown drone against physics and course.
#include <cmath>

#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"

namespace trueline::testing_simulation {
namespace {

using Eigen::Vector3d;

TEST(Flight, HoverReadsMinusGravity) {
  SimulationConfig config = ReadShipped("hover");
  config.imu.accel_noise_density = 0.0;
  config.imu.gyro_noise_density = 0.0;
  config.duration = 2.0;
  const FlightLog log = Simulate(config, 1);
  for (const ImuSample& sample : log.imu) {
    EXPECT_NEAR((sample.accel - Vector3d(0, 0, -9.81)).norm(), 0.0, 1e-6);
    EXPECT_NEAR(sample.gyro.norm(), 0.0, 1e-6);
  }
}

// Distance from the hippodrome, written independently: a stadium of two straights of 3 m and two
// half circles of 1.5 m about (3, 1.5) and (0, 1.5).
double OffHippodrome(const Vector3d& p) {
  const double along = std::clamp(p.x(), 0.0, 3.0);
  const double across = std::hypot(p.x() - along, p.y() - 1.5) - 1.5;
  return std::hypot(across, p.z() + 1.5);
}

TEST(Flight, StaysOnTheHippodromeAtItsSpeed) {
  const Flown flown = Fly(ReadShipped("hippodrome", 30.0));
  for (const simulation::TruthSample& sample : flown.truth.trajectory) {
    EXPECT_LT(OffHippodrome(sample.p_E), 0.15) << "at " << sample.t << " s";
    EXPECT_NEAR(sample.v_E.norm(), 1.8, 0.2) << "at " << sample.t << " s";
  }
  EXPECT_NEAR(flown.truth.laps, 30.0 * 1.8 / (6.0 + 3.0 * M_PI), 0.02);
}

TEST(Flight, HeadsAlongThePathAndBanksIntoTheTurn) {
  const Flown flown = Fly(ShortExactFlight());
  int turning = 0;
  for (const simulation::TruthSample& sample : flown.truth.trajectory) {
    const Vector3d v_B = sample.q_E_B.conjugate() * sample.v_E;
    EXPECT_NEAR(std::atan2(v_B.y(), v_B.x()), 0.0, 0.2);
    const double right_down = (sample.q_E_B * Vector3d::UnitY()).z();
    if (sample.p_E.x() > 4.2 ||
        sample.p_E.x() < -1.2) {  // well inside a turn, which is to the right
      ++turning;
      EXPECT_GT(right_down, std::sin(0.12));
    }
  }
  EXPECT_GT(turning, 1000);
}

TEST(Flight, SpecificForceIntegratesToTheTruePath) {
  SimulationConfig config = ReadShipped("hippodrome", 10.0);
  const auto samples = Fly(config).truth.trajectory;
  Vector3d p = samples[0].p_E, v = samples[0].v_E;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dt = samples[i].t - samples[i - 1].t;
    const auto acceleration = [&](std::size_t k) -> Vector3d {
      return samples[k].q_E_B * samples[k].f_B + Vector3d(0, 0, 9.81);
    };
    const Vector3d a = acceleration(i - 1), b = acceleration(i);
    p += dt * v + dt * dt / 6.0 * (2.0 * a + b);
    v += 0.5 * dt * (a + b);
  }
  EXPECT_LT((p - samples.back().p_E).norm(), 5e-3);
  EXPECT_LT((v - samples.back().v_E).norm(), 2e-3);
}

// Eq. 6, 9, 14, 15 integrated from the log alone, written out here with matrices of eq. 1.
Eigen::Matrix3d MatrixOfEquation1(double phi, double theta, double psi) {
  const double cf = std::cos(phi), sf = std::sin(phi), ct = std::cos(theta), st = std::sin(theta),
               cp = std::cos(psi), sp = std::sin(psi);
  Eigen::Matrix3d m;
  m << ct * cp, ct * sp, -st,                                   //
      sf * st * cp - cf * sp, sf * st * sp + cf * cp, sf * ct,  //
      cf * st * cp + sf * sp, cf * st * sp - sf * cp, cf * ct;
  return m;
}

// The thrust is what makes the accelerometer's z axis read its value (eq. 8).
TEST(Flight, ExactFlightObeysEquations6To9) {
  const SimulationConfig config = ShortExactFlight();
  const Flown flown = Fly(config);
  const Vector3d ahrs = config.ahrs.constant, imu = config.imu.misalignment;
  const Eigen::Matrix3d R_B_I = MatrixOfEquation1(imu.x(), imu.y(), imu.z());
  const Eigen::Matrix3d R_Ep_E = MatrixOfEquation1(ahrs.x(), ahrs.y(), ahrs.z());
  const double b_az = config.imu.accel_bias.z(), dt = 1.0 / 512.0;
  Vector3d p = flown.truth.trajectory[0].p_E, v = flown.truth.trajectory[0].v_E;
  const auto acceleration = [&](std::size_t k, const Vector3d& velocity) -> Vector3d {
    const Eigen::Matrix3d R_I_Ep = flown.log.attitude[k].q_Ep_I.conjugate().toRotationMatrix();
    const Eigen::Matrix3d R_B_E = R_B_I * R_I_Ep * R_Ep_E;
    const Vector3d v_B = R_B_E * velocity;
    Vector3d a_B(config.vehicle.drag.x() * v_B.x(), config.vehicle.drag.y() * v_B.y(), 0.0);
    a_B.z() = (flown.log.imu[k].accel.z() - b_az - R_B_I.col(2).dot(a_B)) / R_B_I(2, 2);
    return Vector3d(0, 0, 9.81) + R_B_E.transpose() * a_B;
  };
  for (std::size_t i = 1; i < flown.log.imu.size(); ++i) {  // Heun's method
    const Vector3d a = acceleration(i - 1, v);
    const Vector3d b = acceleration(i, v + dt * a);
    p += dt * v + 0.5 * dt * dt * a;
    v += 0.5 * dt * (a + b);
  }
  EXPECT_LT((p - flown.truth.trajectory.back().p_E).norm(), 2e-3);
  EXPECT_LT((v - flown.truth.trajectory.back().v_E).norm(), 1e-3);
}

TEST(Flight, SameSeedSameBytesOtherSeedOtherNoise) {
  SimulationConfig config = ReadShipped("hippodrome", 5.0);
  const FlightLog a = Simulate(config, 7), b = Simulate(config, 7), c = Simulate(config, 8);
  ASSERT_EQ(a.imu.size(), b.imu.size());
  for (std::size_t i = 0; i < a.imu.size(); ++i) ASSERT_EQ(a.imu[i].accel, b.imu[i].accel);
  ASSERT_EQ(a.fixes.size(), b.fixes.size());
  for (std::size_t i = 0; i < a.fixes.size(); ++i) ASSERT_EQ(a.fixes[i].p_E, b.fixes[i].p_E);
  EXPECT_NE(a.imu[100].accel, c.imu[100].accel);
  EXPECT_NE(a.fixes[0].p_E, c.fixes[0].p_E);
}

TEST(Flight, StreamsKeepTheirRates) {
  SimulationConfig config = ReadShipped("figure_eight", 10.0);
  const FlightLog log = Simulate(config, 1);
  EXPECT_EQ(log.imu.size(), 5121U);
  EXPECT_EQ(log.mocap.size(), 1201U);
  EXPECT_EQ(log.rotors.size(), 1001U);
  EXPECT_EQ(log.range.size(), 501U);
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    ASSERT_NEAR(SecondsBetween(log.imu[i - 1].t, log.imu[i].t), 1.0 / 512.0, 1.1e-9);
  }
}

// Sum of k_f u equals the true thrust, so rotors.csv is usable.
TEST(Flight, LoggedRotorsMakeTheThrust) {
  SimulationConfig config = ReadShipped("figure_eight", 5.0);
  config.sensors["rotors"]["rate"] = 512.0;
  const Flown flown = Fly(config);
  ASSERT_TRUE(flown.log.vehicle.has_value());
  for (std::size_t i = 0; i < flown.log.rotors.size(); ++i) {
    double thrust = 0.0;
    for (std::size_t r = 0; r < 4; ++r) {
      thrust += flown.log.vehicle->rotors[r].k_f * std::pow(flown.log.rotors[i].values[r], 2);
    }
    ASSERT_NEAR(thrust / *flown.log.vehicle->mass, flown.truth.trajectory[i].thrust, 1e-9);
  }
}

}  // namespace
}  // namespace trueline::testing_simulation
