// Score tests on rows drawn at random.
#include "problems/diagnosis/score_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "problems/common/random.h"
#include "problems/diagnosis/linearisation.h"
#include "problems/effects/declaration.h"

namespace trueline {
namespace {

// Columns 0 and 1 are nuisances, 2 is another column, 3 is a multiple of 2 plus nuisances. The
// residual holds `size` times column 2. Each row is a cluster.
Linearisation Drawn(double size) {
  constexpr int kRows = 400;
  Random random(5, "rows");
  Eigen::MatrixXd rows(kRows, 5);
  for (double& x : rows.reshaped()) x = random.Normal();
  rows.col(1) *= 1e3;  // units differ
  rows.col(3) = 0.3 * rows.col(2) + 2.0 * rows.col(0) - 7.0 * rows.col(1);
  rows.col(4) += size * rows.col(2);
  std::vector<Eigen::MatrixXd> grams;
  for (const auto row : rows.rowwise()) grams.emplace_back(row.transpose() * row);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(4);
  Linearisation fit(ReducedSystem(std::move(grams), {none, none}, 0.0, 0.0));
  fit.nuisances = {0, 1};
  return fit;
}

ScoreTest TestBeside(const Linearisation& fit, const std::vector<int>& nuisances, int tested) {
  return TestColumns(fit, nuisances, {tested}, Eigen::VectorXd::Zero(1));
}

TEST(ScoreTest, FindsAColumnBesideNuisances) {
  const Linearisation fit = Drawn(-0.5);  // the step of least cost is then about 0.5
  const ScoreTest test = TestBeside(fit, {0, 1}, 2);
  EXPECT_NEAR(test.value[0], 0.5, 0.2);
  EXPECT_LT(test.p(), 1e-6);
  // Column 3 is the same beside the nuisances, but for its unit.
  const ScoreTest other = TestBeside(fit, {0, 1}, 3);
  EXPECT_NEAR(0.3 * other.value[0], test.value[0], 1e-6);
  EXPECT_NEAR(other.chi2, test.chi2, 1e-4 * test.chi2);
}

TEST(ScoreTest, NuisancesImitateAColumnMoreOrLess) {
  const Linearisation fit = Drawn(0.0);
  EXPECT_NEAR(OwnShare(fit, {}, 2), 1.0, 1e-12);
  EXPECT_NEAR(OwnShare(fit, {0, 1}, 2), 1.0, 0.02);
  EXPECT_LT(OwnShare(fit, {0, 1}, 3), 1e-7);
  EXPECT_GT(OwnShare(fit, {0, 1}, 3), 0.0);
}

// An error of the model as large as that of the noise makes what is found 1.4 times as large.
TEST(ScoreTest, AnErrorOfTheModelHidesSizes) {
  const ScoreTest test = TestBeside(Drawn(0.0), {0, 1}, 2);
  const double alone = DetectableSize(test, 1e-3)[0];
  EXPECT_GT(alone, 4.0 * test.sigma[0]);
  const Eigen::MatrixXd error = test.sigma.cwiseAbs2().asDiagonal();
  EXPECT_NEAR(DetectableSize(test, 1e-3, {error})[0], std::sqrt(2.0) * alone, 0.05 * alone);
}

// What rounding leaves of a column is no evidence, whatever its size.
// A nuisance moves a value by chance as far as it adds to the value's error. What goes beyond is an
// error of the model.
TEST(ScoreTest, AMoveBeyondChanceWidensTheErrors) {
  const Linearisation fit = Drawn(-0.5);
  const ScoreTest test = TestBeside(fit, {0}, 2), beside = TestBeside(fit, {0, 1}, 2);
  ScoreTest widened = test;
  widened.Widen(beside);
  EXPECT_NEAR(widened.sigma[0], test.sigma[0], 0.2 * test.sigma[0]);
  ScoreTest moved = beside;
  moved.value[0] += 0.5;
  widened.Widen(moved);
  EXPECT_NEAR(widened.sigma[0], 0.5, 0.1);
  EXPECT_GT(widened.p(), 0.1);
}

TEST(ScoreTest, AColumnThatOthersExplainWhollyIsNotSignificant) {
  for (const double size : {0.0, -0.5, 30.0}) {
    const Linearisation fit = Drawn(size);
    const ScoreTest test = TestBeside(fit, {0, 1, 2}, 3);
    EXPECT_EQ(test.gain, 0.0) << size;
    EXPECT_EQ(test.value[0], 0.0) << size;
    EXPECT_GT(test.p(), 0.99) << size;
    EXPECT_TRUE(std::isfinite(test.sigma[0])) << size;
  }
}

// A cause in the model whose columns a term repeats: its whole size is not significant beside it.
TEST(ScoreTest, ACauseThatATermRepeatsIsNotSignificantBesideIt) {
  Linearisation fit = Drawn(0.0);
  fit.found = {{{3}, Eigen::VectorXd::Ones(1)}};
  const std::vector<Found> found{
      {Candidate{&InfoOf("fix_scale"), {}}, Eigen::VectorXd::Constant(1, 5.0)}};
  EXPECT_LT(TestFound(fit, found, 0).p(), 1e-6);
  EXPECT_GT(TestFound(fit, found, 0, {2}).p(), 0.5);
}

}  // namespace
}  // namespace trueline
