// Velocities from noisy positions in bursts, attitude and accelerometer.
#include <gtest/gtest.h>

#include <cmath>

#include "problems/common/random.h"
#include "problems/observability/flight_from_log.h"
#include "problems/observability/observe.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kRate = 0.6;      // rad/s, of the ellipse

Vector3d PlaceAt(double t) { return {3.0 * std::sin(kRate * t), 2.0 * std::cos(kRate * t), -1.5}; }
Vector3d SpeedAt(double t) {
  return kRate * Vector3d(3.0 * std::cos(kRate * t), -2.0 * std::sin(kRate * t), 0.0);
}

struct Ellipse {
  std::vector<ImuSample> imu;
  std::vector<AttitudeSample> attitude;
  std::vector<PositionReading> positions;  // ten in 0.3 s, every 2 s
};

// A level vehicle on an ellipse; its attitude is logged in an earth frame that is turned by
// `heading`.
Ellipse FlyEllipse(double heading) {
  Ellipse flight;
  Random random(1, "fixes");
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(-heading, Vector3d::UnitZ()));
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.005 * i;
    const Vector3d a_E = -kRate * kRate * (PlaceAt(t) - Vector3d(0.0, 0.0, -1.5));
    flight.imu.push_back({FromSeconds(t), a_E - Vector3d(0.0, 0.0, kGravity), Vector3d::Zero()});
    flight.attitude.push_back({FromSeconds(t), turned});
    if (i % 400 >= 60 || i % 6 != 0) continue;
    flight.positions.push_back({FromSeconds(t), PlaceAt(t) + 0.05 * random.NormalVector3(), 0.05});
  }
  return flight;
}

// m/s, on all axes together.
double VelocityError(const SmoothedPath& path) {
  double sum = 0.0;
  int count = 0;
  for (double t = 2.0; t < 28.0; t += 0.1, ++count) {
    sum += (path.VelocityAt(t) - SpeedAt(t)).squaredNorm();
  }
  return std::sqrt(sum / count);
}

TEST(SmoothedPath, VelocityIsKnownBetterThanThePositionsAloneTell) {
  const Ellipse flight = FlyEllipse(0.0);
  const SmoothedPath path = SmoothPath(flight.imu, flight.attitude, flight.positions, kGravity);
  // A line through ten positions in 0.3 s has a slope that is wrong by 0.17 m/s on each axis.
  EXPECT_LT(VelocityError(path), 0.1);
  EXPECT_LT(path.sigma, 0.06);
  EXPECT_EQ(path.heading, 0.0);
}

TEST(SmoothedPath, HeadingOfTheAttitudeIsFound) {
  const Ellipse flight = FlyEllipse(2.0);
  const SmoothedPath path = SmoothPath(flight.imu, flight.attitude, flight.positions, kGravity);
  EXPECT_NEAR(path.heading, 2.0, 0.1);
  EXPECT_LT(VelocityError(path), 0.15);
}

double SigmaOfDrag(const FlightLog& log) {
  const CaseResult result = RunObserveLog(log, std::nullopt, nullptr).at(0);
  const int drag = ImuDrivenSystem::kParameters + kDragInTheta;
  for (std::size_t i = 0; i < result.rank.states.size(); ++i) {
    if (result.rank.states[i] == drag) return result.sigma[i];
  }
  return NAN;
}

// Noise of fixes that passes for motion made this bound fifty times too small.
TEST(ObserveLog, SlowFixesWithoutMocapGiveABoundOfTheSameOrder) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 40.0);
  FlightLog log = Simulate(config, 1);
  ASSERT_FALSE(log.mocap.empty());
  const double with = SigmaOfDrag(log);
  log.mocap.clear();
  EXPECT_GT(SigmaOfDrag(log), 0.1 * with);
}

TEST(ObserveLog, AFlightWithoutAttitudeIsAskedByTheProgramsOwnFilter) {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 15.0);
  FlightLog log = Simulate(config, 1);
  log.attitude.clear();
  const auto cases = RunObserveLog(log, std::nullopt, nullptr);
  ASSERT_EQ(cases.size(), 1u);
  EXPECT_EQ(cases[0].name, "imu_driven");
}

}  // namespace
}  // namespace trueline
