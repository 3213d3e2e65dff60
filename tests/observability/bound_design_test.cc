// Designs by the bound: better than where they began, within the limits, flyable from rest.
#include "problems/observability/bound_design.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "problems/observability/run_design.h"
#include "problems/simulation/simulate_rotor_flight.h"

namespace trueline {
namespace {

const std::filesystem::path kByBound =
    TRUELINE_TEST_SOURCE_DIR "/config/design/sensor_position_bound.yaml";
const auto kQuiet = [](const std::string&) {};

DesignTask ShortTask(int evaluations) {
  DesignTask task = ReadDesignTask(YamlMap::FromFile(kByBound), 1, 0);
  task.options.shape.duration = 4.0;
  task.compare = 2;
  auto& bound = std::get<BoundDesign>(task.criterion);
  bound.duration = 4.0;
  bound.candidates = 3;
  bound.ramp = 1.0;
  bound.evaluations = evaluations;
  return task;
}

// Not from rest, and nothing is evolved.
BoundDesign ThreeSeconds() {
  auto design = std::get<BoundDesign>(ShortTask(0).criterion);
  design.duration = 3.0;
  design.ramp = 0.0;
  return design;
}

TEST(BoundDesign, SlowSameSeedGivesTheSameFlightOnAnyNumberOfThreads) {
  DesignTask task = ShortTask(12);
  const DesignOutcome first = RunDesignTask(task, kQuiet);
  task.options.threads = std::get<BoundDesign>(task.criterion).threads = 1;
  EXPECT_EQ(RunDesignTask(task, kQuiet).result.score, first.result.score);
  ASSERT_EQ(first.random_scores.size(), 2u);
  EXPECT_GT(first.random_scores.front(), 0.0);
}

TEST(BoundDesign, SlowAnEvolvedFigureNarrowsMoreWithinTheSameLimitsFromRest) {
  const DesignTask task = ShortTask(480);
  const DesignOutcome outcome = RunDesignTask(task, kQuiet);
  const DesignResult& result = outcome.result;
  EXPECT_GT(result.score, 1.05 * result.start_score);
  EXPECT_GT(result.score, outcome.random_scores.back());
  EXPECT_LE(result.use.worst, 1.0 + 1e-6);
  const FlatMatrix start = result.path.Expand(0.0, 3);
  const FlatMatrix end =
      result.path.ExpandPiece(result.path.num_pieces() - 1, result.path.end(), 3);
  EXPECT_LT(start.norm(), 1e-6);
  EXPECT_LT(end.rightCols(3).norm(), 1e-6);
  EXPECT_LT(end.col(0).head<3>().norm(), 1e-6);
}

// The normal equations with columns against the batch's own information; then considered effects on
// top of both.
TEST(BoundDesign, BoundsAreThoseOfTheBatch) {
  BoundDesign design = ThreeSeconds();
  const std::vector<ConsideredEffect> considered = std::exchange(design.considered, {});
  const PiecewisePolynomial path = DesignFigure(design, kQuiet).path;
  const Flown flown = Fly(design.simulation, path, design.seed);
  const Eigen::MatrixXd bound =
      RotorBound(ModelOf(design.simulation), flown.data, {design.simulation.noise, design.prior},
                 flown.nodes, flown.truth.constants);
  const std::vector<double> sigma = FlownSigmas(design, path);
  design.considered = considered;
  const std::vector<double> wide = FlownSigmas(design, path);
  for (const int i : design.prior.Free()) {
    EXPECT_NEAR(sigma[i], std::sqrt(bound(i, i)), 1e-6 * sigma[i]) << kRotorConstants[i].name;
    EXPECT_GE(wide[i], sigma[i]) << kRotorConstants[i].name;
  }
  EXPECT_GT(wide[0], 1.2 * sigma[0]);  // rotor differences look like mass differences
}

TEST(BoundDesign, MoreFlightHasASmallerBound) {
  BoundDesign design = ThreeSeconds();
  const DesignedFigure figure = DesignFigure(design, kQuiet);
  const double brief = FlownBound(design, figure.path);
  EXPECT_EQ(figure.start_bound, brief);  // nothing was evolved: the same flight, by the same limits
  design.duration = 6.0;
  EXPECT_LT(FlownBound(design, DesignFigure(design, kQuiet).path), 0.8 * brief);
  EXPECT_LT(brief, 1.0);
}

}  // namespace
}  // namespace trueline
