// Designs by the bound: better than where they began, within the limits, flyable from rest.
#include "problems/observability/bound_design.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <utility>

#include "problems/observability/assessment.h"
#include "problems/observability/design.h"
#include "problems/observability/design_score.h"
#include "problems/observability/variable.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "tests/observability/test_vehicle.h"

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
  bound.simulation.imu_rate = 100.0;
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
  const DesignTask task = ShortTask(160);
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

// --- The evolution strategy on functions whose smallest values are known.

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

TEST(Variable, GradientOfAFunctionByHand) {
  Tape::OfThread().Clear();
  const Variable x = Variable::Independent(0.6), y = Variable::Independent(1.7);
  const Variable f = sin(x) * y / sqrt(x + y * y) - cos(y) + Variable(0.0) * x;
  std::vector<double> adjoints;
  Tape::OfThread().StartAdjoints(&adjoints);
  adjoints[f.entry()] = 1.0;
  Tape::OfThread().Sweep(&adjoints);
  const double a = 0.6, b = 1.7, root = std::sqrt(a + b * b);
  EXPECT_NEAR(f.value(), std::sin(a) * b / root - std::cos(b), 1e-15);
  EXPECT_NEAR(adjoints[x.entry()],
              std::cos(a) * b / root - std::sin(a) * b / (2 * root * root * root), 1e-14);
  EXPECT_NEAR(adjoints[y.entry()],
              std::sin(a) / root - std::sin(a) * b * b / (root * root * root) + std::sin(b), 1e-14);
}

DesignTarget TargetOf(const RotorDrivenSystem& system) {
  DesignTarget target;
  for (const char* name : {"r_BP_x", "r_BP_y", "r_BP_z", "I_z"}) {
    target.interest.push_back(FindState(system.errors(), name));
  }
  target.asked = system.PaperStates();
  target.scale = TypicalSizes(system.errors());
  target.weights = system.OutputWeights();
  return target;
}

TEST(DesignScore, SoftMinimumIsJustBelowTheSmallestEigenvalueAndHasItsGradient) {
  RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const DesignTarget target = TargetOf(system);
  std::srand(2);
  const Eigen::MatrixXd k = 100.0 * Eigen::MatrixXd::Random(90, RotorDrivenSystem::kErrors);
  const Eigen::MatrixXd w = k.transpose() * k;
  const SoftMinimum soft = LogSoftMinimum(w, target);
  const double smallest = ScoreStates(w, target.interest, target.asked, target.scale).sigma_min;
  EXPECT_LE(soft.log_value, std::log(smallest) + 1e-12);
  EXPECT_GE(soft.log_value, std::log(smallest) - std::log(4.0) / 6.0);
  Eigen::MatrixXd direction = Eigen::MatrixXd::Random(k.cols(), k.cols());
  direction = (direction + direction.transpose()).eval();
  const double h = 1.0;
  const double change = (LogSoftMinimum(w + h * direction, target).log_value -
                         LogSoftMinimum(w - h * direction, target).log_value) /
                        (2 * h);
  EXPECT_NEAR(change, soft.gradient.cwiseProduct(direction).sum(), 1e-5 * std::abs(change));
}

TEST(DesignScore, GradientAgreesWithFiniteDifferences) {
  RotorDrivenSystem system(TestQuadrotor(), OnlySensors(true, false, true));
  const SplineShape shape{6.0, 12, 7};
  const DesignScore score(system, TestNominal(), shape, TargetOf(system), 1);
  Random random(3);
  FlatMatrix free = RandomControl(shape, 0.5, 0.5, &random), gradient;
  score.Evaluate(free, &gradient);
  for (const auto& [row, column] : {std::pair{0, 0}, {1, 2}, {2, 4}, {3, 1}}) {
    const double h = 1e-5;
    FlatMatrix moved = free;
    moved(row, column) += h;
    const double up = score.Evaluate(moved, nullptr);
    moved(row, column) -= 2 * h;
    const double down = score.Evaluate(moved, nullptr);
    EXPECT_NEAR(gradient(row, column), (up - down) / (2 * h), 3e-5 * gradient.norm());
  }
}

}  // namespace
}  // namespace trueline
