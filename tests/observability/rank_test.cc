// Ranks of small systems whose Lie derivatives are known by hand.
#include "problems/observability/rank.h"

#include <gtest/gtest.h>

#include "problems/observability/lie_derivatives.h"

namespace trueline {
namespace {

// A point mass on a line with drag k and scale s of its position sensor: x' = v, v' = -k v, y = s
// x. Scale, x and v are observable only jointly: (x, v, k, s) -> (x/c, v/c, k, c s).
struct DragSystem {
  static constexpr int kStates = 4, kMoving = 2, kErrors = 4;
  int num_outputs() const { return 1; }
  template <class T>
  void Derivative(const T* x, const T*, T* dx) const {
    dx[0] = x[1];
    dx[1] = -x[2] * x[1];
  }
  template <class T>
  void Output(const T* x, const T*, T* y) const {
    y[0] = x[3] * x[0];
  }
  template <class C>
  void Seed(const C* x, ceres::Jet<C, 4>* out) const {
    for (int i = 0; i < 4; ++i) out[i] = ceres::Jet<C, 4>(x[i], i);
  }
};

TEST(LieDerivatives, AgreeWithThoseByHand) {
  const double x = 0.3, v = 1.2, k = 0.7, s = 2.0;
  const Eigen::MatrixXd o = ObservabilityMatrix<3, double>(DragSystem{}, {x, v, k, s}, {}, 3);
  Eigen::MatrixXd want(4, 4);  // of L0 = s x, L1 = s v, L2 = -s k v, L3 = s k^2 v, over i!
  want << s, 0, 0, x,          //
      0, s, 0, v,              //
      0, -s * k / 2, -s * v / 2, -k * v / 2,  //
      0, s * k * k / 6, s * k * v / 3, k * k * v / 6;
  EXPECT_LT((o - want).norm(), 1e-14);
}

TEST(ExactRank, FindsTheScaleThatIsLost) {
  const std::vector<Modular> x = {Modular(0.3), Modular(1.2), Modular(0.7), Modular(2.0)};
  const auto o = ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4);
  RankReport report = ExactRank(o, {0, 1, 2, 3});
  EXPECT_EQ(report.rank, 3);
  ASSERT_EQ(report.blocks.size(), 1u);
  EXPECT_EQ(report.blocks[0].states, (std::vector<int>{0, 1, 3}));
  EXPECT_EQ(report.StatusOf(0), "joint: J1");
  EXPECT_EQ(report.StatusOf(2), "ok");

  const Eigen::MatrixXd numeric =
      ObservabilityMatrix<4, double>(DragSystem{}, {0.3, 1.2, 0.7, 2.0}, {}, 4);
  FillDirections(numeric, std::vector<StateInfo>(4), &report);
  const Eigen::Vector3d direction = report.blocks[0].directions.col(0);
  EXPECT_LT((direction - Eigen::Vector3d(1.0, 4.0, -2.0 / 0.3)).norm(), 1e-9);
}

TEST(ExactRank, AtRestTheDragIsNotSeen) {
  const std::vector<Modular> x = {Modular(0.3), Modular(0.0), Modular(0.7), Modular(2.0)};
  const RankReport report =
      ExactRank(ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4), {0, 1, 2, 3});
  EXPECT_EQ(report.rank, 2);
  EXPECT_EQ(report.StatusOf(1), "ok");  // v = 0 is observable: changing it would move y
  EXPECT_EQ(report.StatusOf(2), "unobservable");
  EXPECT_EQ(report.StatusOf(0), report.StatusOf(3));
}

TEST(ExactRank, KnownStatesAreLeftOut) {
  const std::vector<Modular> x = {Modular(0.3), Modular(1.2), Modular(0.7), Modular(2.0)};
  const auto o = ObservabilityMatrix<4, Modular>(DragSystem{}, x, {}, 4);
  EXPECT_EQ(ExactRank(o, {0, 1, 2}).nullity(), 0);
}

TEST(ExactRank, IndependentTiesAreSeparateBlocks) {
  DynamicMatrix<Modular> o(2, 5);  // y1 = a + 2 b, y2 = c - d; e is in neither
  const double rows[2][5] = {{1, 2, 0, 0, 0}, {0, 0, 1, -1, 0}};
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 5; ++j) o(i, j) = Modular(rows[i][j]);
  }
  const RankReport report = ExactRank(o, {0, 1, 2, 3, 4});
  ASSERT_EQ(report.blocks.size(), 3u);
  EXPECT_EQ(report.blocks[0].label, "J1");
  EXPECT_EQ(report.blocks[1].label, "J2");
  EXPECT_EQ(report.StatusOf(4), "unobservable");
}

TEST(NumericalRank, AgreesWithTheExactOne) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Random(50, 4);
  k.col(3) = -2.0 * k.col(1);
  const RankReport report = NumericalRank(k, {0, 1, 2, 3}, 1e-9);
  EXPECT_FALSE(report.exact);
  EXPECT_EQ(report.rank, 3);
  ASSERT_EQ(report.blocks.size(), 1u);
  EXPECT_EQ(report.blocks[0].states, (std::vector<int>{1, 3}));
}

}  // namespace
}  // namespace trueline
