// Innovations against the dense covariance of all rows.
#include "problems/rotor/segment_weight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "problems/common/random.h"

namespace trueline {
namespace {

using Weight = SegmentWeight;

template <int kRows, int kCols>
Eigen::Matrix<double, kRows, kCols> Drawn(Random* random, double size) {
  return Eigen::Matrix<double, kRows, kCols>::NullaryExpr(
      [&](Eigen::Index, Eigen::Index) { return size * random->Normal(); });
}

// A segment of random steps; `with_reading` says which of them start with a reading. Rows and their
// influence by all disturbances and noises are kept side by side.
struct Steps {
  Weight weight;
  // Rows x disturbances, then the noise of each step by state, then one column for each row's
  // noise.
  Eigen::MatrixXd influence;

  explicit Steps(const std::vector<bool>& with_reading, std::uint64_t seed) {
    Random random(seed, "steps");
    const auto steps = static_cast<Eigen::Index>(with_reading.size());
    const auto readings = std::count(with_reading.begin(), with_reading.end(), true);
    const Eigen::Index rows = 6 * readings + Weight::kState;
    const Eigen::Index noise = (6 + Weight::kState) * steps;  // where the rows' noise begins
    influence.setZero(rows, noise + rows);
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(Weight::kState, influence.cols());
    Eigen::Index row = 0;
    for (Eigen::Index k = 0; k < steps; ++k) {
      if (with_reading[k]) {
        const Weight::ReadingByState H = Drawn<6, Weight::kState>(&random, 1.0);
        const Weight::ReadingSquare D = Drawn<6, 6>(&random, 1.0);
        const Weight::Reading sigma = Drawn<6, 1>(&random, 0.3);
        weight.Read(H, D, sigma.cwiseAbs2());
        influence.middleRows(row, 6) = H * moved;
        influence.block<6, 6>(row, 6 * k) += D;  // the disturbance that also moves the state
        for (int i = 0; i < 6; ++i) influence(row + i, noise + row + i) = sigma[i];
        row += 6;
      }
      const Weight::StateByState F =
          Weight::StateByState::Identity() + Drawn<Weight::kState, Weight::kState>(&random, 0.2);
      const Weight::StateByReading G = Drawn<Weight::kState, 6>(&random, 0.5);
      const Weight::State own = Drawn<Weight::kState, 1>(&random, 0.2);
      weight.Step(F, G, own.cwiseAbs2());
      moved = (F * moved).eval();
      moved.middleCols<6>(6 * k) += G;
      moved.middleCols<Weight::kState>(6 * steps + Weight::kState * k).diagonal() += own;
    }
    const Weight::State sigma = Drawn<Weight::kState, 1>(&random, 0.1);
    weight.End(sigma.cwiseAbs2());
    influence.bottomRows(Weight::kState) = moved;
    for (int i = 0; i < Weight::kState; ++i) influence(row + i, noise + row + i) = sigma[i];
  }
};

class SegmentWeightTest : public testing::TestWithParam<std::vector<bool>> {};

TEST_P(SegmentWeightTest, IsThatOfTheDenseCovariance) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Steps steps(GetParam(), seed);
    const Eigen::MatrixXd cov = steps.influence * steps.influence.transpose();
    const Eigen::LLT<Eigen::MatrixXd> llt(cov);
    ASSERT_EQ(llt.info(), Eigen::Success);
    Random random(seed, "rows");
    Eigen::MatrixXd rows(cov.rows(), 5);
    for (double& x : rows.reshaped()) x = random.Normal();
    const Eigen::MatrixXd expected = llt.matrixL().solve(rows);
    Eigen::MatrixXd whitened = rows;
    steps.weight.Whiten(whitened);
    EXPECT_LT((whitened - expected).norm(), 1e-9 * expected.norm());
    // Quadratic forms, which do not depend on the choice of the root.
    const Eigen::MatrixXd forms = rows.transpose() * llt.solve(rows);
    EXPECT_LT((whitened.transpose() * whitened - forms).norm(), 1e-9 * forms.norm());
    const double log_determinant = 2.0 * llt.matrixLLT().diagonal().array().log().sum();
    EXPECT_NEAR(steps.weight.LogDeterminant(), log_determinant,
                1e-9 * (1.0 + std::abs(log_determinant)));
    // The covariance is not diagonal: whitening by its diagonal differs.
    const Eigen::MatrixXd scaled = cov.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * rows;
    EXPECT_GT((scaled - expected).norm(), 0.1 * expected.norm());
  }
}

TEST_P(SegmentWeightTest, RowsOfTheEndAloneStayThere) {
  const Steps steps(GetParam(), 4);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(steps.influence.rows(), Weight::kState);
  rows.bottomRows<Weight::kState>().setIdentity();
  Eigen::MatrixXd end = rows.bottomRows<Weight::kState>();
  steps.weight.WhitenEnd(end);
  steps.weight.Whiten(rows);
  EXPECT_EQ(rows.topRows(rows.rows() - Weight::kState).norm(), 0.0);
  EXPECT_LT((rows.bottomRows<Weight::kState>() - end).norm(), 1e-12 * end.norm());
}

INSTANTIATE_TEST_SUITE_P(Segments, SegmentWeightTest,
                         testing::Values(std::vector<bool>{true, true, true, true, true},
                                         std::vector<bool>{false, true, false, false, true, true},
                                         std::vector<bool>{false, false, true, false},
                                         std::vector<bool>{false, false}));

}  // namespace
}  // namespace trueline
