#include "problems/chain/section_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "problems/common/random.h"

namespace trueline::testing_section_chain {
namespace {

constexpr int kNode = 3, kShared = 2, kLocal = 1, kBorder = 3, kUsed = 2;  // nodes' unknowns in use
constexpr int kSections = 3, kNodes = 4;                                   // nodes in a section
using Chain = SectionChain<kNode, kShared>;

// A random chain, and the same rows as one dense matrix. The last unknown of each node is in no
// row; the second section has no local unknown.
struct Case {
  Chain chain{kBorder, kLocal};
  // Columns of the dense matrix: nodes, then shared unknowns, local ones, the border, the residual.
  static constexpr int kSharedAt = kUsed * kNodes * kSections, kLocalAt = kSharedAt + kShared * 3,
                       kGlobalAt = kLocalAt + kSections, kSize = kGlobalAt + kBorder - kLocal;
  Eigen::MatrixXd dense{0, kSize + 1};
  std::vector<int> node_blocks, section_blocks;

  void Assemble(double radius) {
    Random random(5, "chain");
    dense.resize(0, kSize + 1);
    node_blocks.clear();
    section_blocks.clear();
    chain.Begin(radius);
    for (int k = 0; k < kSections; ++k) {
      for (int i = 0; i < kNodes; ++i) {
        const int s = kNodes * k + i;
        const bool linked = s + 1 < kNodes * kSections;
        Add(7, [&](int r, Chain::Columns* row, Eigen::RowVectorXd* all) {
          for (int j = 0; j < kUsed; ++j) {
            Set(kUsed * s + j, Chain::kNodeAt + j, random.Normal(), row, all);
            if (linked && r < 3) Set(kUsed * (s + 1) + j, Chain::kNextAt + j, 1 + j, row, all);
          }
          SetBorder(k, &random, row, all);
        });
        node_blocks.push_back(chain.EndNode());
      }
      if (k + 1 == kSections) break;
      Add(3, [&](int, Chain::Columns* row, Eigen::RowVectorXd* all) {
        for (int j = 0; j < kShared; ++j) {
          Set(kSharedAt + kShared * k + j, Chain::kSharedAt + j, random.Normal(), row, all);
          Set(kSharedAt + kShared * (k + 1) + j, Chain::kNextSharedAt + j, random.Normal(), row,
              all);
        }
      });
      section_blocks.push_back(chain.EndSection());
    }
    section_blocks.push_back(chain.EndChain());
  }

  // The dense solution's part that a block holds, in the block's order.
  template <class Vector>
  void ExpectStep(const Vector& x) {
    for (int s = 0; s < kNodes * kSections; ++s) {
      const double* step = chain.step(node_blocks[s]);
      for (int j = 0; j < kUsed; ++j) EXPECT_NEAR(step[j], x[kUsed * s + j], 1e-9);
      EXPECT_EQ(step[kUsed], 0.0);
    }
    for (int k = 0; k < kSections; ++k) {
      const double* step = chain.step(section_blocks[k]);
      for (int j = 0; j < kShared; ++j) {
        EXPECT_NEAR(step[j], x[kSharedAt + kShared * k + j], 1e-9);
      }
      EXPECT_NEAR(step[kShared], k == 1 ? 0.0 : x[kLocalAt + k], 1e-9);
    }
    for (int j = 0; j < kBorder - kLocal; ++j) {
      EXPECT_NEAR(chain.step(section_blocks.back())[kShared + kLocal + j], x[kGlobalAt + j], 1e-9);
    }
  }

  Eigen::MatrixXd Hessian() const {
    Eigen::MatrixXd H = dense.leftCols(kSize).transpose() * dense.leftCols(kSize);
    H(kLocalAt + 1, kLocalAt + 1) = 1.0;  // in no row
    return H;
  }

 private:
  template <class Fill>
  void Add(int count, Fill&& fill) {
    Chain::Columns rows = Chain::Columns::Zero(count, chain.width());
    for (int r = 0; r < count; ++r) {
      Chain::Columns row = rows.row(r);
      Eigen::RowVectorXd all = Eigen::RowVectorXd::Zero(kSize + 1);
      fill(r, &row, &all);
      rows.row(r) = row;
      dense.conservativeResize(dense.rows() + 1, Eigen::NoChange);
      dense.bottomRows(1) = all;
    }
    chain.AddRows(rows.data(), count);
  }
  static void Set(int all_at, int at, double value, Chain::Columns* row, Eigen::RowVectorXd* all) {
    (*row)(0, at) = value;
    (*all)[all_at] = value;
  }
  static void SetBorder(int k, Random* random, Chain::Columns* row, Eigen::RowVectorXd* all) {
    for (int j = 0; j < kShared; ++j) {
      Set(kSharedAt + kShared * k + j, Chain::kSharedAt + j, random->Normal(), row, all);
    }
    if (k != 1) Set(kLocalAt + k, Chain::kBorderAt, random->Normal(), row, all);
    for (int j = 0; j < kBorder - kLocal; ++j) {
      Set(kGlobalAt + j, Chain::kBorderAt + kLocal + j, random->Normal(), row, all);
    }
    Set(kSize, Chain::kBorderAt + kBorder, random->Normal(), row, all);
  }
};

TEST(SectionChain, SolvesAsTheDenseSystem) {
  Case c;
  c.Assemble(INFINITY);
  const Eigen::MatrixXd H = c.Hessian();
  const Eigen::VectorXd g = c.dense.leftCols(Case::kSize).transpose() * c.dense.rightCols(1);
  const Eigen::VectorXd x = -H.ldlt().solve(g);
  EXPECT_NEAR(c.chain.Solve(), -0.5 * g.dot(x), 1e-9);
  c.ExpectStep(x);
  EXPECT_NEAR(c.chain.log_det(), std::log(H.determinant()), 1e-9);
}

// Damping is proportional to the diagonal; the predicted decrease is that of the cost itself.
TEST(SectionChain, DampsByTheDiagonal) {
  constexpr double kRadius = 0.7;
  Case c;
  c.Assemble(kRadius);
  const Eigen::MatrixXd H = c.Hessian();
  Eigen::MatrixXd damped = H;
  damped.diagonal() *= 1.0 + 1.0 / kRadius;
  const Eigen::VectorXd g = c.dense.leftCols(Case::kSize).transpose() * c.dense.rightCols(1);
  const Eigen::VectorXd x = -damped.ldlt().solve(g);
  EXPECT_NEAR(c.chain.Solve(), -g.dot(x) - 0.5 * x.dot(H * x), 1e-9);
  c.ExpectStep(x);
}

TEST(SectionChain, CovariancesAreThoseOfTheInverse) {
  Case c;
  c.Assemble(INFINITY);
  const Eigen::MatrixXd cov = c.Hessian().inverse();
  const int kAsked = 3;
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(Case::kSize, kAsked);
  const Eigen::MatrixXd found = c.chain.Covariance(kAsked, [&](int block, Chain::Columns* columns) {
    const auto node = std::find(c.node_blocks.begin(), c.node_blocks.end(), block);
    if (node == c.node_blocks.end()) return;
    const int s = static_cast<int>(node - c.node_blocks.begin()), k = s / kNodes;
    (*columns)(Chain::kNodeAt + 1, 0) += 0.1 * s;
    G(kUsed * s + 1, 0) += 0.1 * s;
    (*columns)(Chain::kSharedAt, 1) += 0.3;
    G(Case::kSharedAt + kShared * k, 1) += 0.3;
    if (s != 0) return;
    (*columns)(Chain::kBorderAt + kLocal, 2) = 1.0;
    G(Case::kGlobalAt, 2) = 1.0;
  });
  EXPECT_LT((found - G.transpose() * cov * G).norm(), 1e-10);

  int visited = 0;
  c.chain.VisitCovariances([&](int block, const Eigen::MatrixXd& F) {
    const auto node = std::find(c.node_blocks.begin(), c.node_blocks.end(), block);
    if (node == c.node_blocks.end()) return;
    const int s = static_cast<int>(node - c.node_blocks.begin()), k = s / kNodes;
    std::vector<int> at{kUsed * s, kUsed * s + 1}, in{0, 1};
    for (int j = 0; j < kShared; ++j) {
      at.push_back(Case::kSharedAt + kShared * k + j);
      in.push_back(kNode + j);
    }
    if (k != 1) at.push_back(Case::kLocalAt + k), in.push_back(kNode + kShared);
    at.push_back(Case::kGlobalAt + 1), in.push_back(kNode + kShared + kLocal + 1);
    EXPECT_LT((F(in, in) - cov(at, at)).norm(), 1e-10) << s;
    EXPECT_EQ(F.row(kUsed).norm(), 0.0);
    ++visited;
  });
  EXPECT_EQ(visited, kNodes * kSections);
}

}  // namespace
}  // namespace trueline::testing_section_chain
