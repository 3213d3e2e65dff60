// The fit against the truth of flights for which eq. 6-9 are exact, and against an independent
// Gauss-Newton in this file: classical Runge-Kutta, finite differences, no part of the project's
// model.
#include <gtest/gtest.h>

#include "tests/common/bands.h"
#include "tests/vgd/flights.h"
#include "tests/vgd/flown_log.h"

namespace trueline::testing_vgd {
namespace {

TEST(RigidFit, FindsTheTrueNine) {
  VgdOptions options = RigidOptions();
  options.gamma = 5;
  SimulationConfig config = ExactHippodrome(30.0);
  config.detector.sigma_factor = 0.003;
  config.detector.sigma_floor = 0.001;
  const Flight flight(config, 3, options);
  const WindowEstimate window = SolveLast(flight, options);
  ASSERT_TRUE(window.converged);
  const Theta truth = TrueTheta(config);
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterEstimate& p = window.parameters[i];
    EXPECT_NEAR(p.value, truth[i], 3.0 * p.sigma) << p.name;
  }
  EXPECT_LT(window.parameters[0].sigma, 0.15);  // a large sigma would make 3 sigma meaningless
  EXPECT_NEAR(window.parameters[3].value, truth[3], 1e-4);
  EXPECT_NEAR(window.parameters[6].value, truth[6], 5e-3);
}

// A truth drawn from the prior (uniform, the ranges of Table 2), and its flight's last window.
struct Draw {
  Draw(int seed, const VgdOptions& options, Random* random)
      : truth(DrawTruth(options, random)),
        flight(WithTruth(truth), 100 + seed, options),
        data(CutWindow(flight.data, options,
                       flight.data.FirstPassOf(Last(), options.gamma, options.min_window_fixes),
                       Last(), false)),
        problem(flight.data.track, data, options) {}

  static Theta DrawTruth(const VgdOptions& options, Random* random) {
    Theta theta;
    for (int i = 0; i < kMotionSize; ++i) {
      const ParameterPrior& prior = options.priors[i];
      theta[i] = prior.mean + std::sqrt(3.0) * prior.sigma * random->Uniform(-1.0, 1.0);
    }
    return theta;
  }
  static SimulationConfig WithTruth(const Theta& theta) {
    SimulationConfig config = ExactHippodrome(16.0);
    for (int i = 0; i < kMotionSize; ++i) config.randomise[kTheta[i].name] = {theta[i], theta[i]};
    return DrawVariant(config, 1);
  }
  int Last() const { return static_cast<int>(flight.data.passes.size()); }

  // The cost at the optimum over the free unknowns, starting from `theta`.
  double Solve(const Theta& theta, bool theta_is_free) {
    problem.SetStart(theta, RoughPath(flight.data.log.fixes, data.passes));
    std::vector<double*> blocks;
    problem.problem().GetParameterBlocks(&blocks);
    for (double* block : blocks) {
      const bool is_theta = problem.problem().ParameterBlockSize(block) == kThetaSize;
      if (is_theta && !theta_is_free) problem.problem().SetParameterBlockConstant(block);
    }
    return problem.Solve().final_cost;
  }

  Theta truth;
  Flight flight;
  WindowData data;
  WindowProblem problem;
};

// Over 20 flights: if model and weights are right, twice the decrease of the cost from the truth to
// the optimum is chi-square with nine degrees of freedom, and errors agree with their sigmas. (The
// squared error normalised by the covariance at the optimum is about 12 instead of 9, because the
// weakly observable directions form a curved valley.)
TEST(RigidFit, SlowErrorsAreAsLargeAsStated) {
  const VgdOptions options = RigidOptions();
  Random random(11, "truth");
  double fall = 0.0;
  int within_two_sigma = 0;
  for (int seed = 0; seed < 20; ++seed) {
    Draw draw(seed, options, &random);
    const double best = draw.Solve(PriorMeans(options), true);
    const Theta error = draw.problem.Parameters().head<kMotionSize>() - draw.truth;
    const auto cov = draw.problem.Covariance();
    for (int i = 0; i < kMotionSize; ++i) {
      const double sigma = options.priors[i].sigma * std::sqrt(cov(i, i));
      within_two_sigma += std::abs(error[i]) < 2.0 * sigma;
    }
    fall += 2.0 * (draw.Solve(draw.truth, false) - best);
  }
  // 99 % of a chi-square of 180 is within 134 ... 232; the uniform truth has a smaller spread than
  // the normal prior.
  EXPECT_GT(fall, 120.0);
  EXPECT_LT(fall, 232.0);
  ExpectCoverage(within_two_sigma, 180, 0.9545, "within two sigmas");
}

// Least squares of the window written out independently.
class IndependentFit {
 public:
  using Unknowns = Eigen::Matrix<double, kMotionSize + 6, 1>;  // then p and v at the start

  IndependentFit(const FlightLog& log, const VgdOptions& options, const WindowEstimate& window)
      : log_(log), options_(options), begin_(window.begin), end_(window.end) {}

  Unknowns Solve(Unknowns x) const {
    for (int round = 0; round < 15; ++round) {
      const Eigen::VectorXd r = Residuals(x);
      Eigen::MatrixXd J(r.size(), x.size());
      for (int i = 0; i < x.size(); ++i) {
        const double h = 1e-5;
        Unknowns up = x, down = x;
        up[i] += h;
        down[i] -= h;
        J.col(i) = (Residuals(up) - Residuals(down)) / (2.0 * h);
      }
      x -= (J.transpose() * J).ldlt().solve(J.transpose() * r);
    }
    return x;
  }

  double Cost(const Unknowns& x) const { return 0.5 * Residuals(x).squaredNorm(); }

 private:
  // Attitude and thrust between samples (both streams share their stamps).
  Drive DriveAt(std::size_t i, double s) const {
    const double a = log_.imu[i].accel.z(), b = log_.imu[i + 1].accel.z();
    const auto q = log_.attitude[i].q_Ep_I.slerp(s, log_.attitude[i + 1].q_Ep_I);
    return {q.toRotationMatrix(), a + s * (b - a)};
  }

  Eigen::VectorXd Residuals(const Unknowns& x) const {
    std::vector<double> r;
    for (int i = 0; i < kMotionSize; ++i) {
      r.push_back((x[i] - options_.priors[i].mean) / options_.priors[i].sigma);
    }
    Eigen::Vector3d p = x.segment<3>(kMotionSize), v = x.tail<3>();
    std::size_t fix = 0;
    while (log_.fixes[fix].t < begin_) ++fix;
    for (std::size_t i = 0; i + 1 < log_.imu.size(); ++i) {
      const TimeNs t0 = log_.imu[i].t, t1 = log_.imu[i + 1].t;
      TimeNs from = std::max(t0, begin_);
      while (from < t1 && from <= end_ && fix < log_.fixes.size()) {
        const TimeNs to = std::min(t1, log_.fixes[fix].t);
        Step(x, i, SecondsBetween(t0, from) / SecondsBetween(t0, t1),
             SecondsBetween(t0, to) / SecondsBetween(t0, t1), SecondsBetween(from, to), &p, &v);
        from = to;
        if (log_.fixes[fix].t != to) break;
        const Eigen::Vector3d e = (p - log_.fixes[fix].p_E) / log_.fixes[fix].sigma;
        if (log_.fixes[fix].t <= end_) r.insert(r.end(), {e.x(), e.y(), e.z()});
        ++fix;
      }
    }
    return Eigen::Map<Eigen::VectorXd>(r.data(), static_cast<Eigen::Index>(r.size()));
  }

  // Classical Runge-Kutta over a part (from s0 to s1) of the interval after sample i.
  void Step(const Unknowns& x, std::size_t i, double s0, double s1, double h, Eigen::Vector3d* p,
            Eigen::Vector3d* v) const {
    using testing_window::Acceleration;
    const Drive start = DriveAt(i, s0), middle = DriveAt(i, 0.5 * (s0 + s1)), end = DriveAt(i, s1);
    const Eigen::Vector3d a1 = Acceleration(x, start, *v);
    const Eigen::Vector3d a2 = Acceleration(x, middle, *v + a1 * h / 2);
    const Eigen::Vector3d a3 = Acceleration(x, middle, *v + a2 * h / 2);
    const Eigen::Vector3d a4 = Acceleration(x, end, *v + a3 * h);
    *p += *v * h + (a1 + a2 + a3) * h * h / 6.0;
    *v += (a1 + 2 * a2 + 2 * a3 + a4) * h / 6.0;
  }

  const FlightLog& log_;
  VgdOptions options_;
  TimeNs begin_, end_;
};

TEST(RigidFit, SlowMeetsAnIndependentGaussNewton) {
  VgdOptions options = RigidOptions();
  options.gamma = 2;
  options.tolerance = 1e-10;
  const Flight flight(ExactHippodrome(12.0), 5, options);
  const WindowEstimate window = SolveLast(flight, options);
  ASSERT_GE(window.gamma, 2);
  const IndependentFit reference(flight.data.log, options, window);
  IndependentFit::Unknowns start;
  const LineFit line = RoughPath(flight.data.log.fixes, flight.data.passes).At(window.begin);
  start << PriorMeans(options), line.p, line.v;
  const IndependentFit::Unknowns best = reference.Solve(start);
  EXPECT_NEAR(window.cost, reference.Cost(best), 1e-3 * window.cost);
  for (int i = 0; i < kMotionSize; ++i) {
    const ParameterEstimate& p = window.parameters[i];
    EXPECT_NEAR(p.value, best[i], 0.02 * p.sigma) << p.name;
  }
}

// Starts from all of Table 2 end at the same optimum, with the paper's rigid window.
TEST(RigidFit, SlowManyStartsReachOneOptimum) {
  VgdOptions options = RigidOptions();
  const Flight flight(ExactHippodrome(16.0), 7, options);
  const int tau = static_cast<int>(flight.data.passes.size());
  const StartStudy study = StudyStarts(flight.data, options, tau, 20, 1);
  EXPECT_EQ(study.starts, 20);
  EXPECT_EQ(study.same_optimum, 20);
  ASSERT_EQ(study.costs.size(), 20U);
  EXPECT_LE(*std::max_element(study.iterations.begin(), study.iterations.end()),
            25);  // the paper's
}

}  // namespace
}  // namespace trueline::testing_vgd
