// The evolution strategy on functions whose smallest values are known.
#include "problems/observability/evolve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trueline {
namespace {

// An ellipsoid whose axes differ a thousandfold, with a kink: |x_0| beside squares.
double Kinked(const Eigen::VectorXd& x) {
  double sum = std::abs(x[0]);
  for (int j = 1; j < x.size(); ++j) sum += std::pow(10.0, 0.6 * j) * x[j] * x[j];
  return sum;
}

TEST(Evolve, FindsTheEndOfAKinkedEllipsoid) {
  const Eigen::VectorXd start = Eigen::VectorXd::Constant(6, 2.0), unit = Eigen::VectorXd::Ones(6);
  const Evolved evolved = Evolve(Kinked, start, unit, {6000, 0.3, 3, 1});
  EXPECT_LT(evolved.value, 1e-6 * Kinked(start));
  EXPECT_DOUBLE_EQ(evolved.value, Kinked(evolved.x));
}

TEST(Evolve, KeepsTheStartWhereNothingIsBetter) {
  const auto only_start = [](const Eigen::VectorXd& x) { return x.isZero() ? 1.0 : INFINITY; };
  const Eigen::VectorXd start = Eigen::VectorXd::Zero(3);
  const Evolved evolved = Evolve(only_start, start, Eigen::VectorXd::Ones(3), {60, 0.1, 1, 1});
  EXPECT_EQ(evolved.x, start);
  EXPECT_EQ(evolved.value, 1.0);
}

TEST(Evolve, DoesNotDependOnThreads) {
  const Eigen::VectorXd start = Eigen::VectorXd::Ones(4), unit = start;
  const Evolved one = Evolve(Kinked, start, unit, {240, 0.3, 5, 1});
  const Evolved two = Evolve(Kinked, start, unit, {240, 0.3, 5, 2});
  EXPECT_EQ(one.x, two.x);
}

}  // namespace
}  // namespace trueline
