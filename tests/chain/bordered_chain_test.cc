#include "problems/chain/bordered_chain.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace trueline
