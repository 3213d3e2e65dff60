// The chain's elimination against one dense least-squares solution of the same rows.
#include "problems/diagnosis/chain_system.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "problems/diagnosis/base_fit.h"
#include "tests/simulation/short_flight.h"

namespace trueline {
namespace {

class ShortChain : public testing::Test {
 protected:
  void SetUp() override {
    SimulationConfig config = testing_simulation::ReadShipped("hippodrome");
    config.duration = 22.0;
    flown_ = testing_simulation::Fly(config, 4);
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

// All rows as one matrix over (nodes, border, residual), priors of the border at the end.
Eigen::MatrixXd DenseRows(const LinearFlight& linear, const NoiseStrengths& noise) {
  const int segments = static_cast<int>(linear.flight.plan().segments.size());
  const int nodes = segments * kNodeSize, width = linear.width(), z = width - 1;
  std::vector<SegmentRows> stacks;
  int count = z;
  for (int s = 0; s < segments; ++s) {
    stacks.push_back(RowsOf(linear, s, noise));
    count += stacks.back().count();
  }
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(count, nodes + width);
  int at = 0;
  for (int s = 0; s < segments; ++s) {
    const int rows = stacks[s].count();
    dense.block(at, s * kNodeSize, rows, kNodeSize) = stacks[s].node();
    if (s + 1 < segments) dense.block(at, (s + 1) * kNodeSize, rows, kNodeSize) = stacks[s].next();
    dense.block(at, nodes, rows, width) = stacks[s].border();
    at += rows;
  }
  for (int i = 0; i < z; ++i, ++at) {
    const bool theta = i < kThetaSize;
    const double root = theta ? 1.0 : std::sqrt(linear.columns.precision[i - kThetaSize]);
    dense(at, nodes + i) = root;
    dense(at, nodes + z) =
        root * (theta ? linear.x.theta[i] : linear.columns.value[i - kThetaSize]);
  }
  return dense;
}

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

TEST_F(ShortChain, SolvesAsOneDenseProblemDoes) {
  const LinearFlight linear = fit_.Linear(*flight_);
  const ChainSystem system(linear, fit_.noise);
  const Eigen::MatrixXd dense = DenseRows(linear, fit_.noise);
  const int unknowns = static_cast<int>(dense.cols()) - 1, z = linear.width() - 1;
  const Eigen::VectorXd x =
      -dense.leftCols(unknowns).colPivHouseholderQr().solve(dense.col(unknowns));
  const Eigen::VectorXd border = system.reduced().Solution();
  EXPECT_LT((border - x.tail(z)).norm(), 1e-4 * (1.0 + x.tail(z).norm()));

  const Eigen::VectorXd with_residual = system.reduced().Fitted();
  const auto nodes = system.chain().NodesAt(with_residual);
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const auto expected = x.segment<kNodeSize>(static_cast<int>(s) * kNodeSize);
    EXPECT_LT((nodes[s].col(0) - expected).norm(), 1e-4 * (1.0 + expected.norm())) << s;
  }
  // The sum of squared residuals, split into clusters.
  const double rest = (dense.leftCols(unknowns) * x + dense.col(unknowns)).squaredNorm();
  const double priors =
      (dense.bottomRows(z).leftCols(unknowns) * x + dense.bottomRows(z).col(unknowns))
          .squaredNorm();
  EXPECT_NEAR(system.ByCluster().ClusterProducts(with_residual, with_residual).sum(), rest - priors,
              1e-5 * rest);
}

// The fit's nuisances keep whitened residuals at their stated size.
TEST_F(ShortChain, ResidualsOfAnOrdinaryFlightAreOrdinary) {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::VectorXd whitened =
      system.Whitened(system.reduced().Fitted()).head(3 * plan_.fixes.size());
  EXPECT_NEAR(std::sqrt(whitened.squaredNorm() / static_cast<double>(whitened.size())), 1.0, 0.2);
}

}  // namespace
}  // namespace trueline
