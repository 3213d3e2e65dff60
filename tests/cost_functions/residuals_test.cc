// Every residual of a window: value by an independent integration, derivatives against central
// differences, whitening with a covariance that is not diagonal.
#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "cost_functions/continuity_residual.h"
#include "cost_functions/drag_residual.h"
#include "cost_functions/fix_residual.h"
#include "cost_functions/huber.h"
#include "cost_functions/models/process_noise.h"
#include "problems/common/random.h"
#include "problems/effects/effect.h"
#include "tests/vgd/flown_log.h"

namespace trueline::testing_window {
namespace {

using Eigen::Vector3d;

const TimeNs kStart = FromSeconds(1.0), kFix = FromSeconds(1.503), kEnd = FromSeconds(2.0);

// A segment of a flight of the test's own, its unknowns, and the three kinds of nodes.
class SegmentTest : public testing::Test {
 protected:
  void SetUp() override {
    Random random(3, "unknowns");
    for (double& value : theta_) value = random.Uniform(-1.0, 1.0);
    for (double* node : {node_, next_}) {
      for (int i = 0; i < kStateAt; ++i) node[i] = random.Uniform(-0.5, 0.5);
      for (int i = kStateAt; i < kGustAt; ++i) node[i] = random.Uniform(-2.0, 2.0);
    }
  }

  // The first parameters of a residual, in their order; the first two move the segment.
  std::vector<double*> Blocks(int count) { return {blocks_.begin(), blocks_.begin() + count}; }

  double* drift() { return node_; }
  double* state() { return node_ + kStateAt; }
  // The drift with the attitude filter's errors over the segment, which act as a drift does.
  Vector3d Turned() const {
    return Eigen::Map<const Vector3d>(node_) +
           scaling_.DriftUnit().cwiseInverse().asDiagonal() *
               (track_.attitude_errors().MeanOver(kStart, kEnd) *
                Eigen::Map<const Eigen::Matrix<double, kFilterSize, 1>>(theta_ + kFilterInTheta));
  }

  Eigen::VectorXd Residual(const ceres::CostFunction& cost) {
    segment_.Evaluate(theta_, drift(), state(), false);
    Eigen::VectorXd residual(cost.num_residuals());
    const std::vector<double*> blocks = Blocks(int(cost.parameter_block_sizes().size()));
    EXPECT_TRUE(cost.Evaluate(blocks.data(), residual.data(), nullptr));
    return residual;
  }

  void ExpectDerivativesByDifferences(const ceres::CostFunction& cost) {
    const auto& sizes = cost.parameter_block_sizes();
    const std::vector<double*> blocks = Blocks(int(sizes.size()));
    for (std::size_t b = 0; b < sizes.size(); ++b) {
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      RowMajor analytic(cost.num_residuals(), sizes[b]);
      std::vector<double*> jacobians(sizes.size(), nullptr);
      jacobians[b] = analytic.data();  // null for the others, as for constant blocks
      Eigen::VectorXd residual(cost.num_residuals());
      segment_.Evaluate(theta_, drift(), state(), true);
      ASSERT_TRUE(cost.Evaluate(blocks.data(), residual.data(), jacobians.data()));
      for (int i = 0; i < sizes[b]; ++i) {
        const double kept = blocks[b][i], h = 1e-4;
        blocks[b][i] = kept + h;
        const Eigen::VectorXd up = Residual(cost);
        blocks[b][i] = kept - h;
        const Eigen::VectorXd down = Residual(cost);
        blocks[b][i] = kept;
        const Eigen::VectorXd numeric = (up - down) / (2.0 * h);
        EXPECT_LT((analytic.col(i) - numeric).norm(), 1e-6 * (1.0 + numeric.norm()))
            << "block " << b << " column " << i;
      }
    }
  }

  VgdOptions options_;
  FlightLog log_ = FlownLog(3.0);
  DriveTrack track_ = DriveTrack::FromLog(log_, DriveOptions());
  ParameterScaling scaling_{options_};
  Segment segment_{track_, kStart, {kFix, kEnd}, {kFix}, scaling_, 0.03};
  double theta_[kThetaSize], node_[kGustAt], next_[kGustAt];
  double own_[6] = {0.3, -0.2, 0.5, 0.1, -0.4, 0.6};
  std::vector<double*> blocks_ = {theta_, node_, next_};
};

TEST_F(SegmentTest, FixResidualIsWhitenedPositionMisfit) {
  const Vector3d fix(0.3, -0.7, -1.4);
  const FixResidual cost(segment_.StateAt(kFix), {fix, 0.2});
  const Eigen::VectorXd residual = Residual(cost);
  const Vector3d p = Integrate(track_, scaling_, theta_, Turned().data(), state(), kStart, kFix).p;
  EXPECT_LT((residual - (p - fix) / 0.2).norm(), 1e-3);
  ExpectDerivativesByDifferences(cost);
}

TEST_F(SegmentTest, AFixOfAFalsePassIsMovedByItsOffset) {
  blocks_[2] = own_;
  const FixError fix{Vector3d(0.3, -0.7, -1.4), 0.2};
  const OffsetFixResidual cost(segment_.StateAt(kFix), {fix, 0.7});
  const Eigen::VectorXd plain = Residual(FixResidual(segment_.StateAt(kFix), fix));
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(Residual(cost)[i], plain[i] + (own_[i] + 0.7 * own_[3 + i]) / 0.2, 1e-12);
  }
  ExpectDerivativesByDifferences(cost);
}

TEST_F(SegmentTest, DragResidualIsTheAccelerometersMisfit) {
  const Eigen::Vector2d measured(0.4, -0.2);
  const DragResidual cost(segment_.ForceAt(kFix), {measured, 0.5});
  const Eigen::VectorXd residual = Residual(cost);
  const Vector3d f_I = ForceInImu(track_, scaling_, theta_, Turned().data(), state(), kStart, kFix);
  EXPECT_LT((residual - (f_I.head<2>() - measured) / 0.5).norm(), 1e-3);
  ExpectDerivativesByDifferences(cost);
}

TEST_F(SegmentTest, DerivativesIncludeForceEffects) {
  segment_.SetForceEffects(
      ForceEffectsOf({{"quadratic_drag", {{"c", 0.1}}}, {"wind", {{"w_x", 2.0}, {"w_y", -1.0}}}}));
  ExpectDerivativesByDifferences(DragResidual(segment_.ForceAt(kFix), {{0.4, -0.2}, 0.5}));
  ExpectDerivativesByDifferences(FixResidual(segment_.StateAt(kFix), {Vector3d::Zero(), 0.2}));
}

TEST_F(SegmentTest, ContinuityResidualIsTheStepBetweenSegments) {
  const double alpha = 0.6;
  const ContinuityResidual cost(segment_.end_node(),
                                {scaling_.DriftUnit(), alpha, Matrix9d::Identity()});
  const Eigen::VectorXd residual = Residual(cost);
  const auto end = Integrate(track_, scaling_, theta_, Turned().data(), state(), kStart, kEnd);
  const double unit = options_.priors[kAhrsInTheta].sigma;
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(residual[i], next_[kStateAt + i] - end.p[i], 1e-3);
    EXPECT_NEAR(residual[3 + i], next_[kStateAt + 3 + i] - end.v[i], 1e-3);
    EXPECT_NEAR(residual[6 + i], unit * (next_[i] - alpha * node_[i]), 1e-12);
  }
}

// Small steps are extrapolated by the derivatives, with an error of second order; large steps are
// integrated.
TEST_F(SegmentTest, FollowsItsDerivativesOnlyWhereThatIsExactEnough) {
  Segment fresh{track_, kStart, {kFix, kEnd}, {kFix}, scaling_, 0.03};
  double largest = 0.0;
  segment_.FollowDerivatives();
  for (const double step : {3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3}) {
    SetUp();
    segment_.Evaluate(theta_, drift(), state(), true);
    for (double& value : theta_) value += step;
    for (int i = 0; i < 3; ++i) state()[3 + i] -= step;
    segment_.Evaluate(theta_, drift(), state(), false);
    fresh.Evaluate(theta_, drift(), state(), false);
    const double off = (segment_.StateAt(kEnd)->value - fresh.StateAt(kEnd)->value).norm();
    EXPECT_LT(off, 1e-5) << step;
    EXPECT_LT((segment_.ForceAt(kFix)->value - fresh.ForceAt(kFix)->value).norm(), 1e-4) << step;
    largest = std::max(largest, off);
    if (step >= 0.1) {
      EXPECT_EQ(off, 0.0) << step;
    }
  }
  EXPECT_GT(largest, 0.0);  // else nothing was extrapolated
}

// e' W e = |U e|^2 must hold with the full covariance; whitening with the wrong triangle passes
// only where the covariance is diagonal.
TEST_F(SegmentTest, ContinuityWhitensWithAFullCovariance) {
  const ProcessNoise noise{.acceleration = 0.3, .tilt = 0.05, .heading = 0.02, .memory = 1.0};
  const Matrix9d cov = ProcessCovariance(noise, 1.0, 9.81, Eigen::Vector3d::UnitZ());
  ASSERT_GT(cov(0, 3), 0.8 * std::sqrt(cov(0, 0) * cov(3, 3)));  // far from diagonal
  const Matrix9d L = cov.llt().matrixL();
  const ContinuityResidual plain(segment_.end_node(),
                                 {scaling_.DriftUnit(), 0.5, Matrix9d::Identity()});
  const ContinuityResidual white(segment_.end_node(), {scaling_.DriftUnit(), 0.5, L.inverse()});
  const Eigen::VectorXd error = Residual(plain);
  const double mahalanobis = error.dot(cov.inverse() * error);
  EXPECT_NEAR(Residual(white).squaredNorm(), mahalanobis, 1e-6 * mahalanobis);
  ExpectDerivativesByDifferences(plain);
  const ContinuityResidual soft(segment_.end_node(),
                                {scaling_.DriftUnit(), 0.5, Matrix9d(0.01 * L.inverse())});
  ExpectDerivativesByDifferences(soft);
}

// Ceres minimises half of rho(|r|^2): the norm itself (eq. 29), not its square.
TEST(NormLoss, IsTheNormOfEq29) {
  const NormLoss loss(1e-3);
  for (const double norm : {0.05, 0.4, 3.0, 40.0}) {
    double rho[3];
    loss.Evaluate(norm * norm, rho);
    EXPECT_NEAR(0.5 * rho[0], norm, 1.1e-3);
    const double s = norm * norm, h = 1e-4 * s;
    double up[3], down[3];
    loss.Evaluate(s + h, up);
    loss.Evaluate(s - h, down);
    EXPECT_NEAR(rho[1], (up[0] - down[0]) / (2 * h), 1e-6 * rho[1]);
    EXPECT_NEAR(rho[2], (up[1] - down[1]) / (2 * h), 1e-5 * std::abs(rho[2]));
  }
}

TEST(NormLoss, IsSmoothAtZero) {
  double rho[3];
  NormLoss(1e-3).Evaluate(0.0, rho);
  EXPECT_EQ(rho[0], 0.0);
  EXPECT_TRUE(std::isfinite(rho[1]) && std::isfinite(rho[2]));
}

}  // namespace
}  // namespace trueline::testing_window
