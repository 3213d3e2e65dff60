// Score tests on rows drawn at random.
#include "problems/diagnosis/score_test.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/common/random.h"
#include "problems/effects/declaration.h"

namespace trueline {
namespace {

// Columns 0 and 1 are nuisances, 2 is another column, 3 is a multiple of 2 plus nuisances. The
// residual holds `size` times column 2. Each row is a cluster.
class Drawn : public Linearisation {
 public:
  explicit Drawn(double size) {
    constexpr int kRows = 400;
    Random random(5, "rows");
    rows_.resize(kRows, 5);
    for (double& x : rows_.reshaped()) x = random.Normal();
    rows_.col(1) *= 1e3;  // units differ
    rows_.col(3) = 0.3 * rows_.col(2) + 2.0 * rows_.col(0) - 7.0 * rows_.col(1);
    rows_.col(4) += size * rows_.col(2);
    M_ = rows_.leftCols(4).transpose() * rows_.leftCols(4);
    b_ = rows_.leftCols(4).transpose() * rows_.col(4);
    nuisances = {0, 1};
  }
  const Eigen::MatrixXd& M() const override { return M_; }
  const Eigen::VectorXd& b() const override { return b_; }
  int clusters() const override { return static_cast<int>(rows_.rows()); }
  Eigen::MatrixXd ClusterProducts(const Eigen::VectorXd& e,
                                  const Eigen::MatrixXd& v) const override {
    return (rows_ * e).asDiagonal() * (rows_ * v);
  }

 private:
  Eigen::MatrixXd rows_, M_;
  Eigen::VectorXd b_;
};

ScoreTest TestBeside(const Drawn& fit, const std::vector<int>& nuisances, int tested) {
  return TestColumns(fit, nuisances, {tested}, Eigen::VectorXd::Zero(1));
}

TEST(ScoreTest, FindsAColumnBesideNuisances) {
  const Drawn fit(-0.5);  // the step of least cost is then about 0.5
  const ScoreTest test = TestBeside(fit, {0, 1}, 2);
  EXPECT_NEAR(test.value[0], 0.5, 0.2);
  EXPECT_LT(test.p(), 1e-6);
  // Column 3 is the same beside the nuisances, but for its unit.
  const ScoreTest other = TestBeside(fit, {0, 1}, 3);
  EXPECT_NEAR(0.3 * other.value[0], test.value[0], 1e-6);
  EXPECT_NEAR(other.chi2, test.chi2, 1e-4 * test.chi2);
}

TEST(ScoreTest, NuisancesImitateAColumnMoreOrLess) {
  const Drawn fit(0.0);
  EXPECT_NEAR(OwnShare(fit, {}, 2), 1.0, 1e-12);
  EXPECT_NEAR(OwnShare(fit, {0, 1}, 2), 1.0, 0.02);
  EXPECT_LT(OwnShare(fit, {0, 1}, 3), 1e-7);
  EXPECT_GT(OwnShare(fit, {0, 1}, 3), 0.0);
}

// What rounding leaves of a column is no evidence, whatever its size.
TEST(ScoreTest, AColumnThatOthersExplainWhollyIsNotSignificant) {
  for (const double size : {0.0, -0.5, 30.0}) {
    const Drawn fit(size);
    const ScoreTest test = TestBeside(fit, {0, 1, 2}, 3);
    EXPECT_EQ(test.gain, 0.0) << size;
    EXPECT_EQ(test.value[0], 0.0) << size;
    EXPECT_GT(test.p(), 0.99) << size;
    EXPECT_TRUE(std::isfinite(test.sigma[0])) << size;
  }
}

// A cause in the model whose columns a term repeats: its whole size is not significant beside it.
TEST(ScoreTest, ACauseThatATermRepeatsIsNotSignificantBesideIt) {
  Drawn fit(0.0);
  fit.found = {{{3}, Eigen::VectorXd::Ones(1)}};
  const std::vector<Found> found{
      {Candidate{&InfoOf("fix_scale"), {}}, Eigen::VectorXd::Constant(1, 5.0)}};
  EXPECT_LT(TestFound(fit, found, 0).p(), 1e-6);
  EXPECT_GT(TestFound(fit, found, 0, {2}).p(), 0.5);
}

}  // namespace
}  // namespace trueline
