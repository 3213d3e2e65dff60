// A linear problem with Gaussian noise, on which the fixed-lag smoother, the least squares over the
// whole flight and the Kalman filter in this file must agree.
#include <gtest/gtest.h>

#include "problems/common/random.h"
#include "problems/smoother/smoother.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

constexpr double kPassTime = 1.2, kLapTime = 2.2;  // s: passes with fixes, then arcs without

// A vehicle that never rotates, without drag: position, velocity, thrust bias and small tilts enter
// linearly. The fixes are those of a random path; the comparison needs no truth.
FlightLog UnturnedLog(double gravity) {
  Random random(3, "unturned");
  FlightLog log;
  log.gravity = gravity;
  for (int k = 0; k <= 900; ++k) {
    const double t = k / 100.0;
    log.imu.push_back({FromSeconds(t), {0.0, 0.0, -gravity}, Eigen::Vector3d::Zero()});
    log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
    if (k % 7 != 0 || std::fmod(t, kLapTime) >= kPassTime) continue;
    const double sigma = random.Uniform(0.001, 0.002);
    const Eigen::Vector3d p(1.5 * t, -0.3 * t + 0.002 * std::sin(t), 0.1 * t);
    log.fixes.push_back({FromSeconds(t), p + sigma * random.NormalVector3(), sigma, 0});
  }
  return log;
}

VgdOptions LinearOptions(double tilt_sigma, double bias_sigma) {
  constexpr double kKnown = 1e-9;
  VgdOptions options;
  options.gamma = 2;
  options.loss = FixLoss::kNone;
  options.adapt_drift = false;
  options.drag_measurement.enabled = false;
  options.tolerance = 1e-30;
  options.max_iterations = 100;
  options.process = {.acceleration = 0.0005, .tilt = tilt_sigma, .heading = 0.0, .memory = 1.5};
  options.drive.attitude_errors = {0.0, 0.0, 0.0};
  for (ParameterPrior& prior : options.priors) prior = {0.0, kKnown, -1.0, 1.0};
  options.priors[InTheta("b_az")].sigma = bias_sigma;
  for (int i = 0; i < 3; ++i) options.priors[kAhrsInTheta + i].sigma = tilt_sigma;
  return options;
}

// State: p, v (3 each), b_az, phi and theta of the constant tilt, phi and theta of its drift.
class KalmanFilter {
 public:
  static constexpr int kSize = 11;
  // Extended precision: the large initial variance would cost digits that are compared.
  using Real = long double;
  using Vector = Eigen::Matrix<Real, kSize, 1>;
  using Matrix = Eigen::Matrix<Real, kSize, kSize>;

  // Starts near the first fix.
  KalmanFilter(const VgdOptions& options, double gravity)
      : process_(options.process), gravity_(gravity) {
    x.segment<3>(3) << 1.5L, -0.3L, 0.1L;
    Vector variance = Vector::Constant(1e6);  // p and v are unknown
    variance[6] = std::pow(options.priors[2].sigma, 2);
    variance.tail<4>().setConstant(std::pow(process_.tilt, 2));
    P = variance.asDiagonal();
  }

  // Motion without noise: dv = g (-theta, phi, 0) - b_az e_z.
  void Move(double h) {
    Matrix A = Matrix::Zero();
    A.block<3, 3>(0, 3).setIdentity();
    A(5, 6) = -1.0;
    A(3, 8) = A(3, 10) = -gravity_;
    A(4, 7) = A(4, 9) = gravity_;
    const Matrix F = Matrix::Identity() + A * h + A * A * (0.5 * h * h);  // A^3 is zero
    x = F * x;
    P = F * P * F.transpose();
  }

  // Process noise over h seconds, added at a knot. The state's drift enters the acceleration.
  void AddNoise(double h) {
    const double alpha = std::exp(-h / process_.memory), tilt2 = process_.tilt * process_.tilt;
    const double q_a = std::pow(process_.acceleration, 2), q = (1.0 - alpha * alpha) * tilt2 / h;
    const double g = gravity_;
    x.tail<2>() *= alpha;
    P.bottomRows<2>() *= alpha;
    P.rightCols<2>() *= alpha;
    const auto add = [&](int i, int j, Real value) {
      P(i, j) += value;
      if (i != j) P(j, i) += value;
    };
    for (int i = 0; i < 3; ++i) {
      const double tilts = i < 2 ? g * g * q : 0.0;  // a small tilt has no effect on the vertical
      add(i, i, q_a * std::pow(h, 3) / 3.0 + tilts * std::pow(h, 5) / 20.0 + 1e-6);
      add(i, 3 + i, q_a * h * h / 2.0 + tilts * std::pow(h, 4) / 8.0);
      add(3 + i, 3 + i, q_a * h + tilts * std::pow(h, 3) / 3.0 + 1e-6);
    }
    for (int k = 0; k < 2; ++k) {  // phi accelerates along y, theta against x
      const int axis = k == 0 ? 1 : 0;
      const double sign = k == 0 ? g : -g;
      add(axis, 9 + k, sign * q * std::pow(h, 3) / 6.0);
      add(3 + axis, 9 + k, sign * q * h * h / 2.0);
      add(9 + k, 9 + k, q * h + 1e-10);
    }
  }

  void Update(const Fix& fix) {
    using Matrix3 = Eigen::Matrix<Real, 3, 3>;
    Eigen::Matrix<Real, 3, kSize> H = Eigen::Matrix<Real, 3, kSize>::Zero();
    H.leftCols<3>().setIdentity();
    const Matrix3 R = Matrix3::Identity() * fix.sigma * fix.sigma;
    const Eigen::Matrix<Real, kSize, 3> K =
        P * H.transpose() * (H * P * H.transpose() + R).inverse();
    x += K * (fix.p_E.cast<Real>() - H * x);
    const Matrix I_KH = Matrix::Identity() - K * H;
    P = I_KH * P * I_KH.transpose() + K * R * K.transpose();  // Joseph's form
  }

  Vector x = Vector::Zero();
  Matrix P;

 private:
  ProcessNoise process_;
  double gravity_;
};

// Runs the filter through all fixes of the first `tau` passes and on to the next one's first fix.
KalmanFilter Filter(const FlightLog& log, const FlightData& flight, const VgdOptions& options,
                    int tau) {
  KalmanFilter filter(options, log.gravity);
  TimeNs now = flight.passes.front().begin;
  std::size_t next = flight.passes.front().first;
  const std::size_t last = flight.passes[tau - 1].last;
  for (int k = 0; k < tau; ++k) {
    const TimeNs begin = flight.passes[k].begin, length = flight.passes[k + 1].begin - begin;
    const int knots = static_cast<int>(std::ceil(ToSeconds(length) / options.knot_interval));
    for (int i = 0; i < knots; ++i) {
      const TimeNs from = begin + length * i / knots, to = begin + length * (i + 1) / knots;
      for (; next <= last && log.fixes[next].t < to; ++next) {
        filter.Move(SecondsBetween(now, log.fixes[next].t));
        filter.Update(log.fixes[next]);
        now = log.fixes[next].t;
      }
      filter.Move(SecondsBetween(now, to));
      now = to;
      const bool predicted_to_its_end = k == tau - 1 && i == knots - 1;
      if (!predicted_to_its_end) filter.AddNoise(SecondsBetween(from, to));
    }
  }
  return filter;
}

struct Case {
  double gravity, tilt_sigma, bias_sigma;
};

class LinearFlight : public testing::TestWithParam<Case> {};

constexpr double kRounding = 1e-8;  // of positions, m

TEST_P(LinearFlight, SmootherBatchAndFilterAgree) {
  const auto [gravity, tilt_sigma, bias_sigma] = GetParam();
  const FlightLog log = UnturnedLog(gravity);
  const VgdOptions options = LinearOptions(tilt_sigma, bias_sigma);
  const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
  ASSERT_EQ(flight.passes.size(), 5U);
  SmootherOptions no_walks;
  no_walks.accel_bias_walk = no_walks.ahrs_error_walk = 0.0;
  const EstimatorRun smoother = RunSmoother(flight, options, no_walks);
  VgdOptions whole = options;
  whole.gamma = 100;
  for (int tau = 1; tau < 5; ++tau) {
    const KalmanFilter filter = Filter(log, flight, options, tau);
    const WindowEstimate& lag = smoother.windows[tau - 1];
    const WindowEstimate batch = SolveWindow(flight, whole, tau, PriorMeans(whole));
    for (const WindowEstimate* estimate : {&lag, &batch}) {
      SCOPED_TRACE(estimate == &lag ? "fixed lag" : "batch");
      EXPECT_LT((estimate->arc->p_E - filter.x.head<2>().cast<double>()).norm(), kRounding) << tau;
      EXPECT_LT((estimate->arc->cov - filter.P.topLeftCorner<2, 2>().cast<double>()).norm(), 1e-9)
          << tau;
      EXPECT_NEAR(estimate->parameters[2].value, filter.x[6], 1e-9) << tau;
      EXPECT_NEAR(estimate->parameters[2].sigma, std::sqrt(filter.P(6, 6)), 1e-9) << tau;
      for (const int i : {3, 4}) {
        EXPECT_NEAR(estimate->parameters[i].value, filter.x[4 + i], 1e-9) << tau;
        EXPECT_NEAR(estimate->parameters[i].sigma, std::sqrt(filter.P(4 + i, 4 + i)), 1e-9) << tau;
      }
    }
  }
}

// Tilts of 2e-5 rad, linear to 1e-10, under gravity; then an unknown thrust bias without gravity,
// so that tilts have no effect.
INSTANTIATE_TEST_SUITE_P(Cases, LinearFlight,
                         testing::Values(Case{9.81, 2e-5, 1e-9}, Case{0.0, 1e-6, 0.5}));

}  // namespace
}  // namespace trueline
