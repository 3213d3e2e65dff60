// The chain of a linearised flight under other noise, and its rows. Its elimination is tested in
// tests/chain.
#include "problems/diagnosis/chain_system.h"

#include <gtest/gtest.h>

#include <limits>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/imu_columns.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

class ShortChain : public testing::Test {
 protected:
  void SetUp() override {
    flown_ = testing_simulation::Fly(testing_simulation::ReadShipped("hippodrome", 22.0), 4);
    data_ = std::make_unique<FlightData>(flown_.log, options_.drive, options_.passes,
                                         options_.drag_measurement);
    plan_ = FlightPlan::For(*data_, options_);
    flight_ = std::make_unique<BaseFlight>(flown_.log, plan_, options_, ForceEffects());
    fit_.x = flight_->RoughStart(data_->passes);
    fit_.noise = StartingNoise(options_);
    Solve(flight_.get(), 3, &fit_);
    fit_.columns.d_rows = Eigen::MatrixXd::Random(flight_->rows(), 2);
    fit_.columns.precision = Eigen::Vector2d(0.0, 4.0);
    fit_.columns.value = Eigen::Vector2d(0.1, -0.3);
  }

  VgdOptions options_;
  testing_simulation::Flown flown_;
  std::unique_ptr<FlightData> data_;
  FlightPlan plan_;
  std::unique_ptr<BaseFlight> flight_;
  BaseFit fit_;
};

TEST_F(ShortChain, UnderOtherNoiseIsTheSameSystem) {
  const LinearFlight linear = fit_.Linear(*flight_);
  NoisyFlight noisy(linear);
  NoiseStrengths strong = fit_.noise;
  strong.fix_scale = 1.7;
  strong.force_sigma *= 0.6;
  strong.process.gust *= 3.0;
  strong.process.memory *= 0.5;
  for (const NoiseStrengths& noise : {fit_.noise, strong, fit_.noise}) {
    const ReducedSystem expected = ChainSystem(linear, noise).reduced(),
                        actual = noisy.Reduced(noise);
    EXPECT_LT((actual.M() - expected.M()).norm(), 1e-7 * expected.M().norm());
    EXPECT_LT((actual.b() - expected.b()).norm(), 1e-7 * expected.b().norm());
    EXPECT_NEAR(actual.LogEvidence(kThetaSize), expected.LogEvidence(kThetaSize), 1e-4);
  }
}

// A gust acts from its node's segment and, linearly, from the one before.
TEST_F(ShortChain, RowsFollowTheGusts) {
  constexpr double kGust = 0.5;  // m/s^2
  const FlightRows slopes = flight_->Evaluate(fit_.x, true);
  const Eigen::VectorXd here = flight_->Evaluate(fit_.x, false).r;
  const int last = static_cast<int>(plan_.segments.size()) - 1;
  for (const int s : {last / 2, last}) {
    for (int column = kGustAt; column < kNodeSize; ++column) {
      FlightUnknowns moved = fit_.x;
      moved.nodes[s][column] += kGust;
      Eigen::VectorXd expected = Eigen::VectorXd::Zero(flight_->rows());
      const auto add = [&](int segment, const FlightRows::RowMatrix& slope) {
        std::vector<int> rows = flight_->RowsOfSegment(segment);
        for (int i = 0; i < 6; ++i) rows.push_back(flight_->LinkRow(segment) + i);
        for (const int row : rows) expected[row] += kGust * slope(row, column - kGustAt);
      };
      add(s, slopes.d_gust);
      if (plan_.segments[s - 1].linked) add(s - 1, slopes.d_next_gust);
      const Eigen::VectorXd change = flight_->Evaluate(moved, false).r - here;
      EXPECT_GT(change.norm(), 0.01);
      EXPECT_LT((change - expected).norm(), 1e-9);
    }
  }
}

// --- Columns of numbers that are none.

// A fix 14 km away made one column infinite, and the tests of all other columns no numbers.
TEST(FreeColumns, AColumnThatOverflowsCarriesNoInformation) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Ones(4, 3);
  rows(2, 1) = std::numeric_limits<double>::infinity();
  rows(3, 1) = std::numeric_limits<double>::quiet_NaN();
  const Columns columns = FreeColumns(rows);
  EXPECT_EQ(columns.d_rows.col(0), Eigen::VectorXd::Ones(4));
  EXPECT_EQ(columns.d_rows.col(1), Eigen::VectorXd::Zero(4));
  EXPECT_EQ(columns.d_rows.col(2), Eigen::VectorXd::Ones(4));
}

}  // namespace
}  // namespace trueline