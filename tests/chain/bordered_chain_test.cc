#include "problems/chain/bordered_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "problems/chain/damped_gauss_newton.h"
#include "problems/common/random.h"

namespace trueline {
namespace {

constexpr int kNode = 3, kNodes = 4, kBorder = 3;  // two border unknowns and the residual

// A random chain, and the same rows as one dense matrix over (nodes, border).
struct Case {
  std::vector<NodeRows<kNode>> rows;
  Eigen::MatrixXd dense;

  Case() {
    Random random(3, "chain");
    std::vector<Eigen::MatrixXd> parts;
    for (int i = 0; i < kNodes; ++i) {
      const int count = 6 + i;
      NodeRows<kNode> node(count, kBorder);
      for (Eigen::Index k = 0; k < node.values.size(); ++k) node.values(k) = random.Normal();
      if (i + 1 == kNodes) node.next().setZero();
      for (int r = 0; r < count; ++r) node.cluster[r] = (i + r) % 2, node.id[r] = 100 * i + r;
      node.log_weights = 0.5 * i;
      Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, kNode * kNodes + kBorder);
      all.middleCols(kNode * i, kNode) = node.node();
      if (i + 1 < kNodes) all.middleCols(kNode * (i + 1), kNode) = node.next();
      all.rightCols(kBorder) = node.border();
      parts.push_back(all);
      rows.push_back(node);
    }
    Eigen::Index total = 0;
    for (const auto& part : parts) total += part.rows();
    dense.resize(total, kNode * kNodes + kBorder);
    for (Eigen::Index at = 0; const auto& part : parts) {
      dense.middleRows(at, part.rows()) = part;
      at += part.rows();
    }
  }
};

const ReducedSystem::Prior kPrior{Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.3, 0.0)};

TEST(BorderedChain, ReducesToTheDenseProblem) {
  const Case c;
  const BorderedChain<kNode> chain(c.rows);
  const ReducedSystem reduced = chain.Reduced(kPrior);
  Eigen::MatrixXd H = c.dense.transpose() * c.dense;
  const int n = kNode * kNodes + 2;
  H(n - 2, n - 2) += 1.0;
  Eigen::VectorXd g = H.col(n).head(n);
  g[n - 2] += 0.3;
  const Eigen::MatrixXd normal = H.topLeftCorner(n, n);
  const Eigen::VectorXd solution = -normal.ldlt().solve(g);
  EXPECT_LT((reduced.Solution() - solution.tail<2>()).norm(), 1e-10);
  EXPECT_LT((reduced.Covariance() - normal.inverse().bottomRightCorner<2, 2>()).norm(), 1e-10);
  const auto nodes = chain.NodesAt(reduced.Fitted());
  for (int i = 0; i < kNodes; ++i) {
    EXPECT_LT((nodes[i] - solution.segment<kNode>(kNode * i)).norm(), 1e-9);
  }
  const double cost = 0.5 * (H(n, n) + 0.09 + g.dot(solution));
  const double log_det = std::log(normal.determinant());
  EXPECT_NEAR(reduced.LogEvidence(2), 3.0 - cost - 0.5 * log_det, 1e-9);
}

TEST(BorderedChain, ClustersSumToTheWholeAndCanBeLeftOut) {
  const Case c;
  const BorderedChain<kNode> chain(c.rows);
  const ReducedSystem whole = chain.Reduced(kPrior), parts = chain.Reduced(kPrior, 2);
  EXPECT_LT((whole.M() - parts.M()).norm(), 1e-10);
  EXPECT_LT((whole.b() - parts.b()).norm(), 1e-10);
  EXPECT_NEAR(whole.LogEvidence(2), parts.LogEvidence(2), 1e-9);
  const Eigen::Vector3d e = parts.Fitted();
  const Eigen::MatrixXd v = Eigen::MatrixXd::Identity(3, 2);
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(2, 2);
  const auto nodes = chain.NodesAt(Eigen::MatrixXd::Identity(3, 3));
  Eigen::MatrixXd response(kNode * kNodes + kBorder, 3);
  for (int i = 0; i < kNodes; ++i) response.middleRows(kNode * i, kNode) = nodes[i];
  response.bottomRows<3>().setIdentity();
  const Eigen::MatrixXd at = c.dense * response;
  int row = 0;
  for (const auto& node : c.rows) {
    for (int r = 0; r < node.count(); ++r, ++row) {
      products.row(node.cluster[r]) += at.row(row).dot(e) * at.row(row).head(2);
    }
  }
  EXPECT_LT((parts.ClusterProducts(e, v) - products).norm(), 1e-9);
  const ReducedSystem one = parts.Only({true, false});
  EXPECT_EQ(one.clusters(), 1);
  EXPECT_GT((one.M() - parts.M()).norm(), 0.1);
}

TEST(BorderedChain, ASelectionHoldsTheOtherUnknownsAtZero) {
  const Case c;
  const ReducedSystem all = BorderedChain<kNode>(c.rows).Reduced(kPrior, 2);
  const ReducedSystem second = all.Select({1});
  EXPECT_EQ(second.border(), 1);
  EXPECT_DOUBLE_EQ(second.M()(0, 0), all.M()(1, 1));
  EXPECT_DOUBLE_EQ(second.Solution()[0], -all.b()[1] / all.M()(1, 1));
}

TEST(BorderedChain, NoticesANodeThatNoRowDetermines) {
  Case c;
  c.rows.back().node().setZero();
  c.rows[kNodes - 2].next().setZero();
  EXPECT_FALSE(BorderedChain<kNode>(c.rows).regular());
}

constexpr double kNone = std::numeric_limits<double>::infinity();
const Eigen::Matrix3d kM = (Eigen::Matrix3d() << 4, 1, 0, 1, 3, 1, 0, 1, 2).finished();
const Eigen::Vector3d kB(-4.0, 6.0, -2.0);

TEST(BoundedStep, IsTheNewtonStepWithoutBounds) {
  const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNone);
  EXPECT_LT((BoundedStep(kM, kB, -none, none) + kM.inverse() * kB).norm(), 1e-12);
}

TEST(BoundedStep, HoldsWhatIsBeyondABoundAndSolvesTheOthersBesideIt) {
  const Eigen::Vector3d lowest(-kNone, -1.0, -kNone), highest(kNone, kNone, 0.0);
  const Eigen::Vector3d step = BoundedStep(kM, kB, lowest, highest);
  const Eigen::Vector3d gradient = kM * step + kB;
  EXPECT_DOUBLE_EQ(step[1], -1.0);  // the whole step goes to -3.6
  EXPECT_GT(gradient[1], 0.0);
  EXPECT_DOUBLE_EQ(step[2], 0.0);
  EXPECT_LT(gradient[2], 0.0);
  EXPECT_NEAR(gradient[0], 0.0, 1e-12);
}

TEST(BoundedStep, WhatMayNotMoveStays) {
  const Eigen::Vector3d most(kNone, 0.0, kNone);
  const Eigen::Vector3d step = BoundedStep(kM, kB, -most, most);
  EXPECT_EQ(step[1], 0.0);
  EXPECT_NEAR(step[0], 1.0, 1e-12);
  EXPECT_NEAR(step[2], 1.0, 1e-12);
}

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
