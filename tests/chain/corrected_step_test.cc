#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "problems/chain/damped_gauss_newton.h"

namespace trueline {
namespace {

// A quadratic cost whose curvature along one direction is `times` what Gauss-Newton knows. The
// node's unknowns follow the border's.
class Cost {
 public:
  explicit Cost(double times) {
    Eigen::Matrix3d A;
    A << 2.0, 0.3, 0.1, 0.3, 1.0, -0.2, 0.1, -0.2, 0.5;
    known_ = A;
    const Eigen::Vector3d direction = Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
    const Eigen::Vector3d lean = A * direction;
    whole_ = A + (times - 1.0) / direction.dot(lean) * lean * lean.transpose();
  }
  const Eigen::Matrix3d& known() const { return known_; }
  ChainStep Proposed(const Eigen::Vector3d& z) const {
    const Eigen::Vector3d step = -known_.llt().solve(whole_ * z);
    return {step, {NodeOf(step)}};
  }
  static Eigen::Vector2d NodeOf(const Eigen::Vector3d& z) { return {z[0] + z[1], z[2]}; }

 private:
  Eigen::Matrix3d known_, whole_;
};

// Steps until the border is within 1e-9 of the optimum at zero, each of which `part` is taken.
int Steps(const Cost& cost, bool correct, double part = 1.0) {
  StepCorrector corrector;
  Eigen::Vector3d z(3.0, -1.0, 2.0);
  Eigen::Vector2d node = Cost::NodeOf(z);
  int count = 0;
  for (; z.norm() > 1e-9 && count < 100; ++count) {
    ChainStep step = cost.Proposed(z);
    if (const auto corrected = corrector.Correct(cost.known(), step); corrected && correct) {
      corrector.UseCorrected(*corrected);
      step = *corrected;
    }
    corrector.SetPart(part);
    z += part * step.border;
    node += part * step.nodes[0].col(0);
    EXPECT_NEAR((node - Cost::NodeOf(z)).norm(), 0.0, 1e-9);
  }
  return count;
}

TEST(CorrectedStep, StepsThatAlternateConvergeAtOnce) {
  const Cost cost(1.7);
  EXPECT_GT(Steps(cost, false), 40);
  EXPECT_LE(Steps(cost, true), 4);
}

TEST(CorrectedStep, LearnsFromThePartOfAStepThatWasTaken) {
  const Cost cost(1.7);
  EXPECT_LT(Steps(cost, true, 0.8), Steps(cost, false, 0.8));
}

TEST(CorrectedStep, LeavesStepsOfTheRightCurvatureAlone) {
  const Cost cost(1.0);
  EXPECT_EQ(Steps(cost, true, 0.5), Steps(cost, false, 0.5));
}

TEST(CorrectedStep, FirstStepOfASolveIsGaussNewtons) {
  const Cost cost(1.7);
  StepCorrector corrector;
  const ChainStep step = cost.Proposed({1.0, 2.0, 3.0});
  EXPECT_FALSE(corrector.Correct(cost.known(), step));
  EXPECT_TRUE(corrector.Correct(cost.known(), cost.Proposed({-0.7, -1.4, -2.1})));
  corrector.Reset();
  EXPECT_FALSE(corrector.Correct(cost.known(), step));
}

}  // namespace
}  // namespace trueline
