// What a rotor-driven fit takes from a log.
#include "problems/rotor/rotor_data.h"

#include <cmath>

#include "problems/calibration/rotor_calibration.h"
#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "tests/common/test_files.h"
#include "tests/rotor/rotor_flight_fixture.h"

namespace trueline {
namespace {

FlightLog Fly(bool commands) {
  RotorSimulation sim(WuestVehicle());
  if (commands) {
    sim.motors = simulation::MotorDriveConfig();
    sim.motor_lag = 0.03;
    sim.log_rotors = false;
  }
  return SimulateRotorFlight(sim, RandomPath(6.0, 4), 3);
}

RotorDataOptions OnCommands() {
  const simulation::MotorDriveConfig truth;
  RotorDataOptions options;
  options.rotors = RotorSource::kMotors;
  options.motors = MotorCurve{truth.full_speed, truth.nominal_voltage};
  options.motors_at = MotorValues(0.03, truth.idle, truth.voltage);
  return options;
}

std::string ErrorOf(const FlightLog& log, const RotorDataOptions& options) {
  return trueline::ErrorOf([&] { MakeRotorData(log, 4, options); });
}

TEST(RotorData, APartWithoutPosesIsRefused) {
  FlightLog log = Fly(false);
  const TimeNs begin = log.imu.front().t;
  std::erase_if(log.pose, [&](const PoseSample& pose) {
    const double t = SecondsBetween(begin, pose.t);
    return t > 2.0 && t < 5.0;
  });
  RotorDataOptions options;
  EXPECT_EQ(ErrorOf(log, options), "no error");
  options.start = 2.5;
  options.duration = 2.0;
  EXPECT_THAT(ErrorOf(log, options), AllOf(HasSubstr("0 poses"), HasSubstr("start and end")));
}

TEST(RotorData, ABatteryOfZeroVoltsIsRefused) {
  FlightLog log = Fly(true);
  EXPECT_EQ(ErrorOf(log, OnCommands()), "no error");
  for (ScalarSample& sample : log.battery) sample.value = 0.0;
  EXPECT_THAT(ErrorOf(log, OnCommands()), AllOf(HasSubstr("battery.csv"), HasSubstr("0 V")));
}

// Idle motors before the part that is fitted change nothing: neither its noise nor its speeds.
TEST(RotorData, SpeedsLongBeforeThePartDoNotCount) {
  FlightLog log = Fly(false);
  RotorDataOptions options;
  options.start = 3.0;
  const RotorData as_flown = MakeRotorData(log, 4, options);
  const TimeNs begin = log.imu.front().t;
  double sign = 1.0;
  for (ChannelsSample& sample : log.rotors) {
    if (SecondsBetween(begin, sample.t) > 1.5) break;
    sign = -sign;
    for (double& speed : sample.values) speed = 200.0 + 100.0 * sign;
  }
  const RotorData idle_first = MakeRotorData(log, 4, options);
  EXPECT_EQ(idle_first.measured.model.sigma, as_flown.measured.model.sigma);
  EXPECT_EQ(idle_first.speeds, as_flown.speeds);
}

// The unknown motor_lag and a lag beyond it delay the speeds alike.
TEST(RotorData, AddedLagIsBeyondTheUnknownOne) {
  const FlightLog log = Fly(true);
  RotorDataOptions longer = OnCommands(), added = OnCommands();
  longer.motors_at[kLag] = 0.05;
  added.motor_lag = 0.02;
  const RotorData a = MakeRotorData(log, 4, longer), b = MakeRotorData(log, 4, added);
  EXPECT_DOUBLE_EQ(b.motors_at[kLag], 0.03);
  for (const double t : {1.0, 2.0, 3.0}) {
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(a.InputAt(t).speeds[i], b.InputAt(t).speeds[i], 1e-9);
    }
  }
}

TEST(RotorData, ANegativeLagIsClamped) {
  RotorData data = MakeRotorData(Fly(true), 4, OnCommands());
  data.SimulateMotors(MotorValues(-0.01, 0.1, 1.0));
  EXPECT_GT(data.motors_at[kLag], 0.0);
  for (const auto& speeds : data.speeds) {
    for (const double speed : speeds) EXPECT_TRUE(std::isfinite(speed));
  }
}

struct Series {
  std::vector<double> t;
  Eigen::MatrixXd speeds;
};

// Thrust changes all speeds by up to 150 rad/s, a moment their difference by up to 15 rad/s.
Series Measured(double noise, int count = 2000) {
  Random random(4, "speeds");
  Series series{{}, Eigen::MatrixXd(count, 2)};
  for (int i = 0; i < count; ++i) {
    const double t = 0.004 * i;
    const double thrust = 900.0 + 150.0 * std::sin(3.0 * t), moment = 15.0 * std::sin(11.0 * t);
    series.t.push_back(t);
    series.speeds.row(i) << thrust + moment + noise * random.Normal(),
        thrust - moment + noise * random.Normal();
  }
  return series;
}

double RootMeanSquare(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.size()));
}

TEST(SmoothSpeeds, LearnsTheNoiseAndRemovesMostOfIt) {
  const Series truth = Measured(0.0), measured = Measured(10.0);
  const SpeedModel model = LearnSpeedModel(measured.t, measured.speeds);
  const Eigen::MatrixXd smoothed = SmoothSpeeds(measured.t, measured.speeds, model);
  EXPECT_NEAR(model.sigma, 10.0, 0.7);
  EXPECT_LT(RootMeanSquare(smoothed, truth.speeds), 3.0);
  EXPECT_GT(RootMeanSquare(measured.speeds, truth.speeds), 9.0);
}

TEST(SmoothSpeeds, AgainKeepsMoreOfWhatChanges) {
  const Series truth = Measured(0.0), measured = Measured(10.0);
  const SpeedModel model = LearnSpeedModel(measured.t, measured.speeds);
  const auto lost = [&](int again) {
    return RootMeanSquare(SmoothSpeeds(truth.t, truth.speeds, model, again), truth.speeds);
  };
  EXPECT_LT(lost(1), 0.6 * lost(0));
  EXPECT_LT(lost(3), lost(1));
}

TEST(SmoothSpeeds, LeavesExactSpeedsAsTheyAre) {
  const Series exact = Measured(0.0);
  const SpeedModel model = LearnSpeedModel(exact.t, exact.speeds);
  EXPECT_LT(RootMeanSquare(SmoothSpeeds(exact.t, exact.speeds, model), exact.speeds), 0.05);
  const Eigen::MatrixXd still = Eigen::RowVector2d(800.0, 900.0).replicate(100, 1);
  const std::vector<double> t(exact.t.begin(), exact.t.begin() + 100);
  EXPECT_EQ(LearnSpeedModel(t, still).sigma, 0.0);
  EXPECT_EQ(SmoothSpeeds(t, still, {}), still);
}

TEST(SmoothSpeeds, KeepsFewSamples) {
  const Series few = Measured(10.0, 5);
  const SpeedModel model = LearnSpeedModel(few.t, few.speeds);
  EXPECT_EQ(model.sigma, 0.0);
  EXPECT_EQ(SmoothSpeeds(few.t, few.speeds, model), few.speeds);
}

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
