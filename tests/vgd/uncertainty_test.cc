// Uncertainty of the fit: covariance, statuses, combinations, learned drift, ellipses.
#include <algorithm>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/calibration/calibration.h"
#include "problems/result/identifiability.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_estimate.h"
#include "tests/common/bands.h"
#include "tests/common/matchers.h"
#include "tests/simulation/short_flight.h"
#include "tests/vgd/flights.h"

namespace trueline::testing_vgd {
namespace {

TEST(Identifiability, NamesAnExactlyOpenCombination) {
  // The data determine a + b to 0.01 and c to 0.7, and give no information on a - b.
  Eigen::Matrix3d information = Eigen::Vector3d(1e4, 1e4, 2.0).asDiagonal();
  information(0, 1) = information(1, 0) = 1e4;
  const Eigen::Matrix3d cov = (information + Eigen::Matrix3d::Identity()).inverse();
  const Identifiability result = AnalyseIdentifiability({"a", "b", "c"}, {"m", "s", "rad"},
                                                        Eigen::Vector3d(2.0, 3.0, 4.0), cov);
  EXPECT_THAT(result.status, ElementsAre("weak", "weak", "weak"));
  ASSERT_EQ(result.combinations.size(), 1U);
  EXPECT_THAT(result.combinations[0], HasSubstr(" with "));
  EXPECT_THAT(result.combinations[0], Not(HasSubstr("rad")));
  // In physical units a changes by 2 / sqrt(2) and b by -3 / sqrt(2).
  EXPECT_THAT(result.combinations[0], HasSubstr("1.41 m"));
  EXPECT_THAT(result.combinations[0], HasSubstr("2.12 s"));
}

// Rotor inflow and drag along the thrust on a flight at one rotor speed: the data show a + 2 b to
// 0.01 and nothing else. The prior of a leaves b 0.45 of its own prior's sigma.
TEST(Identifiability, WhatOnlyThePriorOfAnotherShowsIsNotIdentified) {
  const Eigen::Vector2d sum(1.0, 2.0);
  const Eigen::Matrix2d cov = (1e4 * sum * sum.transpose() + Eigen::Matrix2d::Identity()).inverse();
  ASSERT_LT(std::sqrt(cov(1, 1)), 0.5);
  const Identifiability result =
      AnalyseIdentifiability({"a", "b"}, {"m", "m"}, Eigen::Vector2d::Ones(), cov);
  EXPECT_THAT(result.status, ElementsAre("weak", "weak"));
  EXPECT_THAT(result.combinations, ElementsAre("a by +0.894 m with b by -0.447 m"));
}

TEST(Identifiability, StatusesFollowTheShareOfThePriorLeft) {
  const Eigen::Vector3d left(0.49, 0.89, 0.95);
  const Identifiability result =
      AnalyseIdentifiability({"a", "b", "c"}, {"m", "m", "m"}, Eigen::Vector3d::Ones(),
                             Eigen::Matrix3d(left.cwiseAbs2().asDiagonal()));
  EXPECT_THAT(result.status, ElementsAre("identified", "weak", "unobservable"));
  EXPECT_THAT(result.combinations, ElementsAre("c by +1 m"));
}

// One straight shows neither headings nor drag across it, but it shows the bias along the thrust.
TEST(Uncertainty, OneStraightLeavesHeadingsOpen) {
  const VgdOptions options = RigidOptions();
  testing_simulation::Flown flown = testing_simulation::Fly(ExactHippodrome(12.0), 4);
  const Pass first = FindPasses(flown.log.fixes, options.passes).front();
  flown.log.fixes.resize(first.last + 1);
  const FlightData data(flown.log, options.drive, options.passes, options.drag_measurement);
  const EstimatorRun run = RunVgd(data, options);
  ASSERT_EQ(run.windows.size(), 1U);
  for (const char* name : {"psi_I_B", "psi_E_Ep", "K_y"}) {
    EXPECT_EQ(Find(run.windows[0], name).status, "unobservable") << name;
  }
  EXPECT_THAT(run.windows[0].unobservable, Contains(HasSubstr("psi_I_B")));
  EXPECT_NE(Find(run.windows[0], "b_az").status, "unobservable");
}

// With equal drag along x and y the heading of the IMU on its board is unobservable. Under a very
// wide prior the covariance is still finite, and the other parameters are found.
TEST(Uncertainty, SurvivesRankDeficiency) {
  VgdOptions options = RigidOptions();
  options.gamma = 5;
  options.priors[0] = options.priors[1] = {-0.5, 1e-7, -2.0, 0.0};
  for (int i = 2; i < kMotionSize; ++i) options.priors[i] = {0.0, 1e4, -1e6, 1e6};
  SimulationConfig config = ExactHippodrome(30.0);
  config.vehicle.drag.head<2>().setConstant(-0.5);
  config.detector.sigma_factor = 0.01;
  const Flight flight(config, 4, options);
  const int tau = static_cast<int>(flight.data.passes.size());
  const WindowEstimate window = SolveWindow(flight.data, options, tau, PriorMeans(options));
  EXPECT_EQ(Find(window, "psi_I_B").status, "unobservable");
  EXPECT_THAT(window.unobservable, Contains(HasSubstr("psi_I_B")));
  EXPECT_EQ(Find(window, "b_az").status, "identified");
  EXPECT_EQ(Find(window, "phi_E_Ep").status, "identified");
  for (const ParameterEstimate& p : window.parameters) {
    EXPECT_TRUE(std::isfinite(p.value) && std::isfinite(p.sigma)) << p.name;
  }
}

// A tight prior from an earlier flight must not make a good flight look uninformative.
TEST(Uncertainty, StatusTellsWhatTheFlightShowsWhateverThePrior) {
  VgdOptions options = RigidOptions();
  options.gamma = 5;
  SimulationConfig config = ExactHippodrome(30.0);
  config.detector.sigma_factor = 0.005;
  config.detector.sigma_floor = 0.002;
  const Flight flight(config, 4, options);
  const int tau = static_cast<int>(flight.data.passes.size());
  const WindowEstimate wide = SolveWindow(flight.data, options, tau, PriorMeans(options));
  ASSERT_EQ(Find(wide, "K_x").status, "identified");
  for (int i = 0; i < kMotionSize; ++i) {
    options.priors[i].mean = wide.parameters[i].value;
    options.priors[i].sigma = 0.3 * wide.parameters[i].sigma;
  }
  const WindowEstimate tight = SolveWindow(flight.data, options, tau, PriorMeans(options));
  for (int i = 0; i < kMotionSize; ++i) {
    EXPECT_LE(tight.parameters[i].sigma, 0.31 * wide.parameters[i].sigma);
    EXPECT_EQ(tight.parameters[i].status, wide.parameters[i].status) << wide.parameters[i].name;
  }
}

double LearnedTilt(double drift_sigma) {
  SimulationConfig config = ExactHippodrome(25.0);
  config.ahrs.kind = simulation::AhrsKind::kDriftingError;
  config.ahrs.drift_sigma = {drift_sigma, drift_sigma, 0.0};
  config.ahrs.drift_memory = 1.0;
  const VgdOptions options;
  const Flight flight(config, 6, options);
  const std::vector<ProcessNoise> learned = LearnProcess(flight.data, options);
  EXPECT_EQ(learned.front().tilt, options.process.tilt);  // nothing is known yet
  return learned.back().tilt;
}

TEST(ProcessLearner, SlowLearnsHowMuchAVehicleDrifts) {
  const double little = LearnedTilt(0.002), much = LearnedTilt(0.12);
  EXPECT_LE(little, 0.5 * VgdOptions().process.tilt);
  EXPECT_GE(much, 1.5 * VgdOptions().process.tilt);
}

// The default fit on the default flight: its 95 % ellipses contain about 95 % of the arcs' ends and
// are no larger than needed. Nearly all of 40 arcs may lie inside ellipses twice too large, so the
// squared errors over their covariance are tested too, with two degrees of freedom for each arc.
TEST(Uncertainty, SlowEllipsesHoldTheTruth) {
  const VgdOptions options;
  int arcs = 0, inside = 0;
  double error = 0.0, squares = 0.0;
  for (int seed = 1; seed <= 10; ++seed) {
    SimulationConfig config = testing_simulation::ReadShipped("hippodrome", 20.0);
    const Flight flight(config, seed, options);
    const EstimatorRun run = RunVgd(flight.data, options);
    const ArcSummary summary = SummariseArcs(run);
    arcs += summary.error.count;
    inside += summary.inside_95;
    error += summary.error.mean / 10.0;
    squares += SquaredArcErrors(run);
  }
  ASSERT_GE(arcs, 30);
  ExpectCoverage(inside, arcs, 0.95, "95 % ellipses");
  ExpectChiSquare(squares, 2.0 * arcs, "ends of arcs");
  EXPECT_LT(error, 0.35);  // m; the paper's arcs end within 0.2 to 0.3 m
}

// --- Windows of a flight without gates that disagree by more than their sigmas widen them.

constexpr double kSigma = 0.02;

// A run whose windows err in turn by `errors` sigmas in every parameter, and hold `passes` passes;
// fewer at the flight's start.
EstimatorRun RunWith(const std::vector<double>& errors, int passes) {
  EstimatorRun run{"vgd", passes, {}, {}};
  for (const double error : errors) {
    WindowEstimate window;
    window.tau = static_cast<int>(run.windows.size()) + 1;
    window.gamma = std::min(window.tau, passes);
    for (int p = 0; p < kStatedSize; ++p) {
      window.parameters.push_back({kTheta[p].name, error * kSigma, kSigma, "", "identified"});
    }
    run.windows.push_back(window);
  }
  return run;
}

double SigmaOfDrag(const EstimatorRun& run) {
  return run.windows.back().parameters[InTheta("K_x")].sigma;
}

class WindowScatter : public testing::Test {
 protected:
  WindowScatter() { options_.gamma = 1; }
  EstimatorRun Widened(const std::vector<double>& errors, int passes = 1) {
    EstimatorRun run = RunWith(errors, passes);
    WidenByScatter(options_, &run);
    return run;
  }
  VgdOptions options_;
};

TEST_F(WindowScatter, LeavesWindowsThatAgree) {
  EXPECT_DOUBLE_EQ(SigmaOfDrag(Widened({0.5, -0.7, 0.2, -0.4, 0.6})), kSigma);
}

TEST_F(WindowScatter, WidensWindowsThatDisagree) {
  // Eight windows, 3 sigmas to both sides: (2 + 8 * 9) / (2 + 7) = 8.2 times the variance.
  const double sigma = SigmaOfDrag(Widened({3, -3, 3, -3, 3, -3, 3, -3}));
  EXPECT_NEAR(sigma / kSigma, 2.87, 0.05);
}

TEST_F(WindowScatter, UsesWindowsBeforeAlone) {
  const EstimatorRun run = Widened({0, 0, 0, 9, -9});
  EXPECT_DOUBLE_EQ(run.windows[2].parameters[InTheta("K_x")].sigma, kSigma);
  EXPECT_GT(run.windows[4].parameters[InTheta("K_x")].sigma, 2.0 * kSigma);
}

TEST_F(WindowScatter, LeavesTheAttitudesErrorThatChanges) {
  const EstimatorRun run = Widened({9, -9, 9, -9});
  EXPECT_DOUBLE_EQ(run.windows.back().parameters[InTheta("phi_E_Ep")].sigma, kSigma);
}

TEST_F(WindowScatter, NeverStatesMoreThanThePrior) {
  const EstimatorRun run = Widened({99, -99, 99, -99});
  const ParameterEstimate& drag = run.windows.back().parameters[InTheta("K_x")];
  EXPECT_DOUBLE_EQ(drag.sigma, options_.priors[InTheta("K_x")].sigma);
  EXPECT_EQ(drag.status, "weak");
}

TEST_F(WindowScatter, CountsWindowsThatShareNoPass) {
  options_.gamma = 2;  // of four windows the last and the second, which agree
  EXPECT_DOUBLE_EQ(SigmaOfDrag(Widened({50, 0, -50, 0}, 2)), kSigma);
}

// Where passes hold too few fixes, windows reach further back than gamma passes. Neighbours then
// agree because they share a pass.
TEST_F(WindowScatter, CountsLongWindowsBySharedPasses) {
  const double sigma = SigmaOfDrag(Widened({0, 3, 0, -3, 0, 3, 0, -3}, 2));
  // Four windows, 3 sigmas to both sides: (2 + 4 * 9) / (2 + 3) = 7.6 times the variance.
  EXPECT_NEAR(sigma / kSigma, 2.76, 0.05);
}

// --- Forecasts at fixed horizons: where they exist, and that their regions hold the truth as often
// as they say.

FlightLog Fly(std::uint64_t seed) { return testing_simulation::LogOf("hippodrome", 40.0, seed); }

std::vector<Forecast> ForecastsOf(const FlightLog& log, const std::vector<double>& horizons) {
  const VgdOptions options;
  const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
  std::vector<Forecast> forecasts;
  for (const WindowEstimate& window : RunVgd(flight, options).windows) {
    const auto more = ForecastAfter(flight, options, window.tau, ThetaOf(window), horizons);
    forecasts.insert(forecasts.end(), more.begin(), more.end());
  }
  return forecasts;
}

TEST(Forecast, ErrorsGrowWithTheHorizonAndLieInsideTheirRegions) {
  int near = 0, far = 0, inside = 0;
  double near_error = 0.0, far_error = 0.0;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    for (const Forecast& f : ForecastsOf(Fly(seed), {0.1, 1.0})) {
      (f.horizon < 0.5 ? near : far) += 1;
      (f.horizon < 0.5 ? near_error : far_error) += f.error;
      inside += f.rank <= 0.95;
      EXPECT_GT(f.sigma, 0.0);
    }
  }
  ASSERT_GT(far, 15);
  EXPECT_EQ(near, far);
  EXPECT_GT(far_error, 1.5 * near_error);
  EXPECT_GE(inside, 0.85 * (near + far));
}

TEST(Forecast, ThereIsNoneBeyondTheArcOrWithoutMocap) {
  FlightLog log = Fly(1);
  EXPECT_TRUE(ForecastsOf(log, {60.0}).empty());
  log.mocap.clear();
  EXPECT_TRUE(ForecastsOf(log, {0.1}).empty());
}

// Without mocap the truth of an arc's end comes from the next pass's fixes, which err themselves.
TEST(ArcAfter, TruthByFixesHasTheirSigma) {
  FlightLog log = Fly(1);
  const VgdOptions options;
  const auto inside_of = [&](double* sigma) {
    const FlightData flight(log, options.drive, options.passes, options.drag_measurement);
    int inside = 0, count = 0;
    for (const WindowEstimate& window : RunVgd(flight, options).windows) {
      if (!window.arc || !window.arc->truth) continue;
      *sigma = window.arc->truth_sigma;
      inside += window.arc->Inside95();
      ++count;
    }
    EXPECT_GT(count, 8);
    return static_cast<double>(inside) / count;
  };
  double sigma = 0.0;
  EXPECT_GE(inside_of(&sigma), 0.8);
  EXPECT_EQ(sigma, 0.0);
  log.mocap.clear();
  EXPECT_GE(inside_of(&sigma), 0.8);
  EXPECT_GT(sigma, 0.05);
}

}  // namespace
}  // namespace trueline::testing_vgd
