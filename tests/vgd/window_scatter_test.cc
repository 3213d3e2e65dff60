// Windows of a flight without gates that disagree by more than their sigmas widen them.
#include <gtest/gtest.h>

#include <algorithm>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/vgd/window_estimate.h"

namespace trueline {
namespace {

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

}  // namespace
}  // namespace trueline
