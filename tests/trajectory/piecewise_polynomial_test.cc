#include "problems/trajectory/piecewise_polynomial.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trueline {
namespace {

FlatMatrix RandomControl(int count) {
  std::srand(3);
  return FlatMatrix::Random(kFlatOutputs, count);
}

TEST(PiecewisePolynomial, CubicSplineHasItsTextbookBasis) {
  Eigen::Matrix4d want;  // columns of control points, rows of powers
  want << 1, 4, 1, 0, -3, 0, 3, 0, 3, -6, 3, 0, -1, 3, -3, 1;
  EXPECT_LT((SplineBasis(3, 0.0, 3) - want / 6.0).norm(), 1e-14);
}

TEST(PiecewisePolynomial, SplineJoinsSmoothly) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(15), 7, 4.0);
  ASSERT_EQ(p.num_pieces(), 8);
  for (int i = 1; i < p.num_pieces(); ++i) {
    const double t = p.breaks()[i];
    const FlatMatrix before = p.ExpandPiece(i - 1, t, 6), after = p.ExpandPiece(i, t, 6);
    EXPECT_LT((before - after).norm(), 1e-10 * after.norm());
  }
}

TEST(PiecewisePolynomial, RepeatedControlPointsRestAtTheEnds) {
  FlatMatrix control = RandomControl(20);
  for (int i = 1; i < 7; ++i) {
    control.col(i) = control.col(0);
    control.col(19 - i) = control.col(19);
  }
  const auto p = PiecewisePolynomial::FromSpline(control, 7, 4.0);
  EXPECT_LT(p.Expand(p.start(), 6).rightCols(6).norm(), 1e-10);
  EXPECT_LT(p.ExpandPiece(p.num_pieces() - 1, p.end(), 6).rightCols(6).norm(), 1e-8);
  EXPECT_LT((p.Expand(0.0, 0) - control.col(0)).norm(), 1e-13);
}

TEST(PiecewisePolynomial, ExpansionPredictsTheValueNearby) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(12), 7, 5.0);
  const FlatMatrix at = p.Expand(1.3, 7);
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int j = 7; j >= 0; --j) sum = sum * 0.21 + at.col(j);
  EXPECT_LT((sum - p.Expand(1.51, 0)).norm(), 1e-12);
}

TEST(PiecewisePolynomial, HermitePiecesFollowASine) {
  const auto sine = [](double t) {
    FlatMatrix c(kFlatOutputs, 6);
    double factorial = 1.0;
    for (int j = 0; j < 6; ++j) {
      if (j > 0) factorial *= j;
      c.col(j).setConstant(std::sin(t + j * M_PI / 2) / factorial);
    }
    return c;
  };
  const auto p = PiecewisePolynomial::FromExpansions(sine, 1.5, 3);
  for (double t = 0.0; t < 1.5; t += 0.07) {
    EXPECT_NEAR(p.Expand(t, 0)(1, 0), std::sin(t), 1e-13);
    EXPECT_NEAR(p.Expand(t, 4)(2, 4) * 24.0, std::sin(t), 1e-6);
  }
}

TEST(PiecewisePolynomial, ScalingKeepsTheStart) {
  const auto p = PiecewisePolynomial::FromSpline(RandomControl(12), 7, 5.0);
  const auto half = p.Scaled(0.5);
  const Eigen::Vector4d start = p.Expand(0.0, 0), there = p.Expand(2.0, 0);
  EXPECT_LT((half.Expand(0.0, 0) - start).norm(), 1e-14);
  EXPECT_LT((half.Expand(2.0, 0) - (start + 0.5 * (there - start))).norm(), 1e-13);
}

}  // namespace
}  // namespace trueline
