#include "problems/observability/design_score.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "problems/observability/assessment.h"
#include "problems/observability/variable.h"
#include "tests/observability/test_vehicle.h"

namespace trueline {
namespace {

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
