// Preintegrated blocks against stepping the model through every IMU sample.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "problems/result/statistics.h"
#include "problems/simulation/simulate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/solver_options.h"
#include "problems/vgd/vgd_kinematic.h"
#include "tests/common/bands.h"
#include "tests/simulation/short_flight.h"
#include "tests/vgd/flights.h"

namespace trueline::testing_vgd {
namespace {

constexpr double kGravity = 9.81;

// 10 s of brisk turning at an uneven 500 Hz.
FlightLog TurningLog() {
  FlightLog log;
  log.gravity = kGravity;
  for (int k = 0; k <= 5000; ++k) {
    const double t = 0.002 * k + 0.0003 * std::sin(0.37 * k);
    log.imu.push_back({FromSeconds(t),
                       {1.5 * std::sin(1.7 * t), std::cos(2.3 * t), -9.0 + std::sin(0.9 * t)},
                       {2.0 * std::sin(3.1 * t), 1.5 * std::cos(2.7 * t), 1.2}});
    log.attitude.push_back({FromSeconds(t), Eigen::Quaterniond::Identity()});
  }
  return log;
}

KinematicState<double> StepThrough(const ImuInputs& imu, TimeNs from, TimeNs to,
                                   const ImuBias<double>& bias, KinematicState<double> x) {
  imu.ForEachStep(from, to, [&](const ImuInput& input, double dt) {
    KinematicStep(input, bias, kGravity, dt, &x);
    x.q_E_I.normalize();
  });
  return x;
}

class ChainTest : public testing::Test {
 protected:
  const FlightLog log_ = TurningLog();
  const DriveTrack track_ = DriveTrack::FromLog(log_, DriveOptions());
  const ImuInputs imu_{log_, track_};
  const TimeNs from_ = FromSeconds(0.0513), to_ = FromSeconds(9.5117);
};

TEST_F(ChainTest, BlocksOfThirtyMillisecondsFollowEverySampleForTenSeconds) {
  const KinematicChain chain(imu_, from_, {FromSeconds(4.0), to_}, 0.03);
  // Biases at the size of Table 2's ranges; the last at the filter's hard bounds.
  const struct {
    ImuBias<double> bias;
    double p_error;
  } cases[] = {{{}, 1e-4},
               {{{0.1, -0.1, 0.1}, {0.004, -0.003, 0.002}}, 0.001},
               {{{1.0, -1.0, 1.0}, {0.05, -0.05, 0.05}}, 0.1}};
  for (const auto& test : cases) {
    KinematicState<double> start;
    start.v = {2.0, 1.0, 0.0};
    const KinematicState<double> expected = StepThrough(imu_, from_, to_, test.bias, start);
    KinematicState<double> end;
    chain.Integrate(test.bias, start,
                    [&](std::size_t, const KinematicState<double>& x) { end = x; });
    EXPECT_LT((end.p - expected.p).norm(), test.p_error);
    EXPECT_LT(end.q_E_I.angularDistance(expected.q_E_I), 1e-4 + test.bias.gyro.norm() * 1e-3);
  }
}

// At rest and level, gravity and specific force cancel; nothing moves.
TEST_F(ChainTest, RestStaysAtRest) {
  FlightLog rest = log_;
  for (ImuSample& sample : rest.imu) {
    sample.accel = {0.0, 0.0, -kGravity};
    sample.gyro.setZero();
  }
  const DriveTrack track = DriveTrack::FromLog(rest, DriveOptions());
  const KinematicChain chain(ImuInputs(rest, track), from_, {to_}, 0.03);
  chain.Integrate(ImuBias<double>(), KinematicState<double>(),
                  [](std::size_t, const KinematicState<double>& x) {
                    EXPECT_LT(x.p.norm(), 1e-9);
                    EXPECT_LT(x.v.norm(), 1e-9);
                  });
}

// Independent of quaternions and midpoints: a constant rate w about z with a constant force f in I
// gives v = g t + f/w (sin wt, 1 - cos wt) in closed form.
TEST(KinematicStepTest, CircleInClosedForm) {
  const double w = 1.3, f = 2.0, dt = 0.001, t = 2.0;
  const ImuInput input{{f, 0.0, -kGravity}, {0.0, 0.0, w}};
  KinematicState<double> x;
  EulerKinematicState<double> euler;
  for (int k = 0; k < 2000; ++k) {
    KinematicStep(input, ImuBias<double>(), kGravity, dt, &x);
    KinematicStep(input, ImuBias<double>(), kGravity, dt, &euler);
  }
  const Eigen::Vector3d v(f / w * std::sin(w * t), f / w * (1.0 - std::cos(w * t)), 0.0);
  const Eigen::Vector3d p(f / (w * w) * (1.0 - std::cos(w * t)), f / w * (t - std::sin(w * t) / w),
                          0.0);
  EXPECT_LT((x.v - v).norm(), 1e-6);
  EXPECT_LT((x.p - p).norm(), 1e-6);
  EXPECT_LT((euler.v - v).norm(), 1e-6);
  EXPECT_LT((euler.p - p).norm(), 1e-6);
  EXPECT_NEAR(euler.Phi.z(), w * t, 1e-9);
}

// --- The chain's own solver and elimination against Ceres on the same cost.

// A window with everything: outliers (robust losses act), a pass with an offset, gusts, and a
// bound that holds.
struct Window {
  VgdOptions options = Options();
  Flight flight{Config(), 3, options};
  WindowData data = Data();

  static VgdOptions Options() {
    VgdOptions options;
    options.priors[0] = {-0.2, 0.29, -0.3, -0.1};  // without the bound the fit ends at -0.05
    return options;
  }
  static SimulationConfig Config() {
    SimulationConfig config = ExactHippodrome(14.0);
    config.detector.outlier_share = 0.05;
    return config;
  }
  WindowData Data() const {
    WindowData cut = CutWindow(flight.data, options, 0, 3, true);
    cut.offsets = {{1, 2.0, 0.2}};
    return cut;
  }
  std::unique_ptr<WindowProblem> Problem() const {
    auto problem = std::make_unique<WindowProblem>(flight.data.track, data, options);
    problem->SetStart(PriorMeans(options), RoughPath(flight.data.log.fixes, data.passes));
    return problem;
  }
};

TEST(SegmentChain, StepsAsCeresDoes) {
  const Window window;
  const auto own = window.Problem(), with_ceres = window.Problem();
  ASSERT_GT(own->segments().size(), 5U);
  const ceres::Solver::Summary summary = own->Solve();
  ceres::Solver::Summary reference;
  ceres::Solve(SolverOptions(window.options, ceres::SPARSE_NORMAL_CHOLESKY), &with_ceres->problem(),
               &reference);
  EXPECT_EQ(summary.termination_type, reference.termination_type);
  EXPECT_EQ(summary.iterations.size(), reference.iterations.size());
  EXPECT_NEAR(summary.final_cost, reference.final_cost, 1e-8 * reference.final_cost);
  const auto sigma = with_ceres->Covariance().diagonal().cwiseSqrt().eval();
  const ThetaVector difference = own->Parameters() - with_ceres->Parameters();
  for (int i = 0; i < kThetaSize; ++i) {
    EXPECT_LT(std::abs(difference[i]), 1e-5 * own->scaling().sigma[i] * sigma[i]) << i;
  }
  EXPECT_NEAR(own->Parameters()[0], -0.1, 1e-9);
}

// Cost and the Gauss-Newton Hessian of all unknowns at the current point.
struct Dense {
  double cost = 0.0;
  Eigen::MatrixXd H;
  int theta_at = 0;

  explicit Dense(ceres::Problem* problem) {
    ceres::Problem::EvaluateOptions options;
    problem->GetParameterBlocks(&options.parameter_blocks);
    ceres::CRSMatrix crs;
    problem->Evaluate(options, &cost, nullptr, nullptr, &crs);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols);
    for (int row = 0; row < crs.num_rows; ++row) {
      for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k) J(row, crs.cols[k]) = crs.values[k];
    }
    H = J.transpose() * J;
    for (const double* block : options.parameter_blocks) {
      if (problem->ParameterBlockSize(block) == kThetaSize) break;
      theta_at += problem->ParameterBlockSize(block);
    }
  }
  // Without its constant.
  double LogEvidence() const { return -cost - 0.5 * H.ldlt().vectorD().array().log().sum(); }
};

TEST(SegmentChain, EliminatesAsTheDenseHessian) {
  const Window window;
  const auto problem = window.Problem();
  const double at_start = problem->LogEvidence() - Dense(&problem->problem()).LogEvidence();
  problem->Solve();
  const Dense dense(&problem->problem());
  EXPECT_NEAR(problem->LogEvidence() - dense.LogEvidence(), at_start, 1e-5);
  const Eigen::MatrixXd cov =
      dense.H.inverse().block(dense.theta_at, dense.theta_at, kThetaSize, kThetaSize);
  const Eigen::MatrixXd found = problem->Covariance().topLeftCorner(kThetaSize, kThetaSize);
  EXPECT_LT((found - cov).norm(), 1e-6 * cov.norm());
}

// --- VGD-kinematic on simulated laps whose IMU has biases and no noise.

const Eigen::Vector3d kAccelBias(0.12, -0.10, 0.15), kGyroBias(0.006, -0.004, 0.005);

// Exact physics and near-exact fixes; AHRS off by a constant 0.7 to 1.1 deg.
FlightLog BiasedFlight() {
  SimulationConfig config = testing_simulation::ReadShipped("hippodrome_exact", 20.0);
  config.warm_up = 5.0;
  config.imu.accel_bias = kAccelBias;
  config.imu.gyro_bias = kGyroBias;
  config.imu.misalignment.setZero();
  config.detector.sigma_factor = 0.0;
  config.detector.sigma_floor = 0.002;
  return Simulate(config, 1);
}

class VgdKinematicTest : public testing::Test {
 protected:
  EstimatorRun Run(const KinematicOptions& options) const {
    return RunVgdKinematic(flight_, VgdOptions(), options);
  }
  static double MedianError(const EstimatorRun& run) {
    std::vector<double> errors;
    for (const WindowEstimate& window : run.windows) {
      if (window.arc && window.gamma == 3) errors.push_back(window.arc->FinalPointError());
    }
    return Quantile(errors, 0.5);
  }

  const FlightLog log_ = BiasedFlight();
  const FlightData flight_{log_, DriveOptions(), PassOptions(), DragMeasurementOptions()};
};

TEST_F(VgdKinematicTest, FindsBiasesAndTheArcsEnd) {
  KinematicOptions options;  // the simulated IMU has biases and no noise
  options.noise = {0.0, 0.0, 0.0, 0.0};
  options.gyro_from_log = false;
  const EstimatorRun run = Run(options);
  const WindowEstimate& last = run.windows.back();
  ASSERT_TRUE(last.converged);
  Eigen::Matrix<double, 6, 1> truth;
  truth << kAccelBias, kGyroBias;
  for (int i = 0; i < 6; ++i) {
    const ParameterEstimate& found = last.parameters[i];
    EXPECT_EQ(found.status, "identified") << found.name;
    EXPECT_NEAR(found.value, truth[i], 3.5 * found.sigma) << found.name;
    EXPECT_LT(found.sigma, 0.002) << found.name;
  }
  EXPECT_LT(MedianError(run), 0.06);  // its 15 unknowns amplify the fixes' 2 mm to 4 cm
}

// Eq. 38 assumes that the AHRS is exact at the window's start; here it is off by a degree.
TEST_F(VgdKinematicTest, WithoutInitialAttitudeTheAhrsErrorRemains) {
  KinematicOptions paper;
  paper.initial_attitude = false;
  const EstimatorRun with = Run(KinematicOptions()), without = Run(paper);
  EXPECT_EQ(without.windows.back().parameters.size(), 6U);
  EXPECT_EQ(with.windows.back().parameters.size(), 9U);
  EXPECT_GT(MedianError(without), 2.0 * MedianError(with));
}

TEST_F(VgdKinematicTest, CovarianceCoversTheArcsEnd) {
  const ArcCount arcs = CountArcs(Run(KinematicOptions()));
  EXPECT_GE(arcs.count, 3);
  ExpectCovered(arcs);
}

}  // namespace
}  // namespace trueline::testing_vgd
