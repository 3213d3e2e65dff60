// A linear problem, on which the filter, the window's least squares and the batch solution in this
// file must agree.
#include <gtest/gtest.h>

#include "cost_functions/models/kinematic_model.h"
#include "problems/common/random.h"
#include "problems/ekf/ekf.h"
#include "problems/log/flight_log.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_kinematic.h"

namespace trueline {
namespace {

// A flight that never turns: attitude is the identity, specific force in x, y is smooth, and so
// everything is linear in p, v and b_a. Passes of 1.2 s with fixes, arcs of 1 s without.
FlightLog UnturnedFlight(std::uint64_t seed, const Eigen::Vector3d& accel_bias) {
  constexpr double kRate = 100.0, kDuration = 9.0, kGravity = 9.81;
  Random random(seed, "unturned");
  FlightLog log;
  log.gravity = kGravity;
  KinematicState<double> x;
  x.v = Eigen::Vector3d(1.5, -0.3, 0.1);
  for (int k = 0; k <= static_cast<int>(kDuration * kRate); ++k) {
    const double t = k / kRate;
    const auto force = [&](double s) {
      return Eigen::Vector3d(0.8 * std::sin(1.1 * s), 0.6 * std::cos(0.7 * s), -kGravity);
    };
    log.imu.push_back({FromSeconds(t), force(t) + accel_bias, Eigen::Vector3d::Zero()});
    log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
    log.mocap.push_back({FromSeconds(t), x.p, x.q_E_I});
    if (k % 7 == 0 && std::fmod(t, 2.2) < 1.2) {
      const double sigma = random.Uniform(0.05, 0.2);
      log.fixes.push_back({FromSeconds(t), x.p + sigma * random.NormalVector3(), sigma, 0});
    }
    const ImuInput input{0.5 * (force(t) + force(t + 1.0 / kRate)), Eigen::Vector3d::Zero()};
    KinematicStep(input, ImuBias<double>(), kGravity, 1.0 / kRate, &x);
  }
  return log;
}

FlightData LinearDataOf(const FlightLog& log) {
  return FlightData(log, DriveOptions(), PassOptions(), DragMeasurementOptions());
}

constexpr double kBiasSigma = 0.58;

struct Batch {
  Eigen::Vector3d p_end, bias;
  Eigen::Matrix3d cov_p_end, cov_bias;
};

// Weighted least squares for (p0, v0, b) of one axis at a time: the fixes of the first `tau`
// passes, motion by exact integration of piecewise constant force, prior on b alone.
Batch SolveBatch(const FlightLog& log, const FlightData& flight, int tau) {
  const TimeNs t0 = flight.passes.front().begin, t_end = flight.passes[tau].begin;
  // Position gained from t0 to t by the force alone, with p0 = v0 = b = 0.
  const auto gained = [&](TimeNs t) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i + 1 < log.imu.size(); ++i) {
      const TimeNs from = std::max(log.imu[i].t, t0), to = std::min(log.imu[i + 1].t, t);
      if (to <= from) continue;
      const double dt = SecondsBetween(from, to);
      const Eigen::Vector3d a =
          0.5 * (log.imu[i].accel + log.imu[i + 1].accel) + Eigen::Vector3d(0.0, 0.0, log.gravity);
      p += v * dt + 0.5 * dt * dt * a;
      v += a * dt;
    }
    return p;
  };
  const auto row = [&](TimeNs t) {
    const double s = SecondsBetween(t0, t);
    return Eigen::RowVector3d(1.0, s, -0.5 * s * s);
  };
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero(), right = Eigen::Matrix3d::Zero();
  H(2, 2) = 1.0 / (kBiasSigma * kBiasSigma);
  for (std::size_t i = flight.passes.front().first; i <= flight.passes[tau - 1].last; ++i) {
    const Fix& fix = log.fixes[i];
    const double weight = 1.0 / (fix.sigma * fix.sigma);
    H += weight * row(fix.t).transpose() * row(fix.t);
    right += weight * row(fix.t).transpose() * (fix.p_E - gained(fix.t)).transpose();
  }
  const Eigen::Matrix3d cov = H.inverse(), x = H.ldlt().solve(right);  // columns: axes
  const double variance = (row(t_end) * cov * row(t_end).transpose()).value();
  return {x.transpose() * row(t_end).transpose() + gained(t_end), x.row(2).transpose(),
          Eigen::Matrix3d::Identity() * variance, Eigen::Matrix3d::Identity() * cov(2, 2)};
}

// No process noise, attitude and gyro bias known, nothing known of p and v.
EkfOptions KnownAttitude(AttitudeForm form) {
  EkfOptions options;
  options.attitude = form;
  options.gating = EkfGating::kNone;
  options.noise = {0.0, 0.0, 0.0, 0.0};
  options.gyro_from_log = false;
  options.start = {3e3, 3e3, 1e-13, 1e-13, kBiasSigma, 1e-13};
  return options;
}

VgdOptions WholeFlight() {
  VgdOptions options;
  options.gamma = 100;
  options.loss = FixLoss::kNone;
  options.tolerance = 1e-30;
  options.max_iterations = 100;
  return options;
}

// Of estimates, m and m/s^2. Priors as narrow as 1e-13 make the normal equations badly conditioned.
constexpr double kRounding = 1e-7;

class LinearProblem : public testing::TestWithParam<AttitudeForm> {};

TEST_P(LinearProblem, FilterWindowAndBatchAgree) {
  const FlightLog log = UnturnedFlight(3, {0.3, -0.2, 0.1});
  const FlightData flight = LinearDataOf(log);
  const int tau = static_cast<int>(flight.passes.size()) - 1;
  ASSERT_EQ(tau, 4);
  const Batch batch = SolveBatch(log, flight, tau);

  const EstimatorRun ekf = RunEkf(flight, KnownAttitude(GetParam()), 1);
  const ImuInputs imu(flight.log, flight.track);
  KinematicOptions kinematic;
  kinematic.initial_attitude = false;
  kinematic.gyro_bias_sigma = 1e-13;
  kinematic.accel_bias_sigma = kBiasSigma;
  const WindowEstimate window = SolveKinematicWindow(flight, imu, WholeFlight(), kinematic, tau,
                                                     Eigen::Matrix<double, 6, 1>::Zero());
  for (const WindowEstimate* estimate : {&window, &ekf.windows[tau - 1]}) {
    ASSERT_TRUE(estimate->arc);
    EXPECT_LT((estimate->arc->p_E - batch.p_end.head<2>()).norm(), kRounding);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(estimate->parameters[i].value, batch.bias[i], kRounding);
    }
  }
  const WindowEstimate& filtered = ekf.windows[tau - 1];
  EXPECT_LT((filtered.arc->cov - batch.cov_p_end.topLeftCorner<2, 2>()).norm(), 1e-9);
  EXPECT_NEAR(filtered.parameters[0].sigma, std::sqrt(batch.cov_bias(0, 0)), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Forms, LinearProblem,
                         testing::Values(AttitudeForm::kEuler, AttitudeForm::kErrorState));

KinematicOptions KnownAttitudeWindow(double accel_noise) {
  KinematicOptions options;
  options.initial_attitude = false;
  options.gyro_bias_sigma = 1e-13;
  options.noise = {accel_noise, 0.0, 0.0, 0.0};
  return options;
}

Eigen::Matrix2d WindowCovariance(const FlightData& flight, const KinematicOptions& options) {
  const ImuInputs imu(flight.log, flight.track);
  return SolveKinematicWindow(flight, imu, WholeFlight(), options, 4,
                              Eigen::Matrix<double, 6, 1>::Zero())
      .arc->cov;
}

TEST(LinearProblem, WindowCovarianceIsTheBatchs) {
  const FlightLog log = UnturnedFlight(3, {0.3, -0.2, 0.1});
  const FlightData flight = LinearDataOf(log);
  const Batch batch = SolveBatch(log, flight, 4);
  const Eigen::Matrix2d cov = WindowCovariance(flight, KnownAttitudeWindow(0.0));
  EXPECT_LT((cov - batch.cov_p_end.topLeftCorner<2, 2>()).norm(), 1e-9);
}

// With accelerometer noise: the empirical covariance of the arc's end over many noisy IMUs against
// the rigid fit's covariance less the fixes' part.
TEST(LinearProblem, SlowWindowCovarianceKnowsTheImusNoise) {
  constexpr double kNoise = 0.2;  // m/s^2/sqrt(Hz)
  constexpr int kNoisyImus = 200;
  const FlightLog quiet = UnturnedFlight(3, {0.3, -0.2, 0.1});
  const FlightData clean = LinearDataOf(quiet);
  const double expected = WindowCovariance(clean, KnownAttitudeWindow(kNoise)).trace() -
                          WindowCovariance(clean, KnownAttitudeWindow(0.0)).trace();
  double sum = 0.0;
  for (int seed = 0; seed < kNoisyImus; ++seed) {
    FlightLog log = UnturnedFlight(3, {0.3, -0.2, 0.1});
    Random random(seed, "imu");
    for (ImuSample& sample : log.imu) sample.accel += kNoise * 10.0 * random.NormalVector3();
    const FlightData noisy = LinearDataOf(log);
    const auto end = [&](const FlightData& flight) {
      const ImuInputs imu(flight.log, flight.track);
      return SolveKinematicWindow(flight, imu, WholeFlight(), KnownAttitudeWindow(kNoise), 4,
                                  Eigen::Matrix<double, 6, 1>::Zero())
          .arc->p_E;
    };
    sum += (end(noisy) - end(clean)).squaredNorm();
  }
  // 400 squares have a relative sigma of 7 %; the 0.1 s grid places noise slightly too early.
  EXPECT_NEAR(sum / kNoisyImus, expected, 0.25 * expected);
}

}  // namespace
}  // namespace trueline
