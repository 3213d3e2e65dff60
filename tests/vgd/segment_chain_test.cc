// The chain's own solver and elimination against Ceres on the same cost.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "problems/vgd/solver_options.h"
#include "tests/vgd/flights.h"

namespace trueline {
namespace {

using testing_vgd::ExactHippodrome;
using testing_vgd::Flight;

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

}  // namespace
}  // namespace trueline
