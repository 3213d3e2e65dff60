// Sums of evidence: honest where there is no effect, decisive where there is one.
#include "problems/diagnosis/evidence_sum.h"

#include <gtest/gtest.h>

#include <cmath>

#include "problems/common/random.h"
#include "problems/diagnosis/diagnosis.h"

namespace trueline {
namespace {

using Eigen::VectorXd;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

ScoreTest TestOf(double value, double sigma, double scatter, int clusters = 40) {
  ScoreTest test;
  test.value = VectorXd::Constant(1, value);
  test.cov_model = Eigen::MatrixXd::Constant(1, 1, sigma * sigma);
  test.cov_cluster = Eigen::MatrixXd::Constant(1, 1, scatter * scatter);
  test.information = Eigen::MatrixXd::Ones(clusters, 1);
  return test;
}

// The scatter between clusters is estimated from them, as in a flight.
double EvidenceWithout(int clusters, Random* random) {
  double sum = 0.0, squares = 0.0;
  for (int c = 0; c < clusters; ++c) {
    const double x = random->Normal();
    sum += x;
    squares += x * x;
  }
  const double mean = sum / clusters;
  const double scatter = std::sqrt((squares / clusters - mean * mean) / (clusters - 1.0));
  return FlightEvidenceOf(TestOf(mean, 1.0 / std::sqrt(clusters), scatter, clusters),
                          VectorXd::Constant(1, 3.0));
}

// An e-value: its mean without an effect is one at most, so that 20 and more are rare.
TEST(FlightEvidence, HasAMeanOfOneAtMostWithoutAnEffect) {
  constexpr int kSeeds = 20000;
  for (const int clusters : {5, 12, 40}) {
    Random random(1, "evidence");
    double mean = 0.0;
    int large = 0;
    for (int i = 0; i < kSeeds; ++i) {
      const double ratio = std::exp(EvidenceWithout(clusters, &random));
      mean += ratio / kSeeds;
      large += ratio > 20.0;
    }
    EXPECT_LT(mean, 1.05) << clusters;
    EXPECT_LT(large, 0.05 * kSeeds) << clusters;
  }
}

TEST(FlightEvidence, GrowsWithTheSizeUpToItsBound) {
  const VectorXd prior = VectorXd::Constant(1, 1.0);
  double last = -10.0;
  for (const double sigmas : {0.0, 2.0, 3.0, 4.0, 5.0}) {
    const double evidence = FlightEvidenceOf(TestOf(0.02 * sigmas, 0.02, 0.02), prior);
    EXPECT_GT(evidence, last);
    last = evidence;
  }
  EXPECT_LT(FlightEvidenceOf(TestOf(0.0, 0.02, 0.02), prior), -1.0);
  EXPECT_NEAR(FlightEvidenceOf(TestOf(1.0, 0.02, 0.02), prior), std::log(1e5), 0.02);
  // Scores that scatter more than the noise model says, or few clusters, show less.
  const double usual = FlightEvidenceOf(TestOf(0.1, 0.02, 0.02), prior);
  EXPECT_LT(FlightEvidenceOf(TestOf(0.1, 0.02, 0.05), prior), usual);
  EXPECT_LT(FlightEvidenceOf(TestOf(0.1, 0.02, 0.02, 5), prior), usual);
}

// Errors of a known strength that no hypothesis states: a third of them imitates the effect.
// Without the effect the mean stays at one; a size beyond what they imitate is shown as before.
TEST(FlightEvidence, AllowsForErrorsThatNoHypothesisStates) {
  constexpr int kSeeds = 20000;
  const VectorXd prior = VectorXd::Constant(1, 3.0);
  const auto square = [](double sigma) { return Eigen::MatrixXd::Constant(1, 1, sigma * sigma); };
  const UnstatedErrors errors = {square(0.0), square(0.05), square(1.0)};
  Random random(1, "unstated");
  double mean = 0.0, unaware = 0.0;
  for (int i = 0; i < kSeeds; ++i) {
    const double error = std::sqrt(errors[static_cast<std::size_t>(i % 3)](0, 0));
    const double value = 0.1 * random.Normal() + error * random.Normal();
    mean += std::exp(FlightEvidenceOf(TestOf(value, 0.1, 0.1, 400), prior, errors)) / kSeeds;
    unaware += std::exp(FlightEvidenceOf(TestOf(value, 0.1, 0.1, 400), prior)) / kSeeds;
  }
  EXPECT_LT(mean, 1.05);
  EXPECT_GT(unaware, 100.0);
  EXPECT_LT(FlightEvidenceOf(TestOf(1.0, 0.1, 0.1, 400), prior, errors), 2.0);
  EXPECT_GT(FlightEvidenceOf(TestOf(6.0, 0.1, 0.1, 400), prior, errors), 8.0);
  EXPECT_NEAR(MeanSigma(errors, 1)[0], std::sqrt((0.0025 + 1.0) / 3.0), 1e-12);
  EXPECT_EQ(MeanSigma({}, 2), VectorXd::Zero(2));
}

TEST(LogRatio, IsThatOfTheDensities) {
  const VectorXd estimate = VectorXd::Constant(1, 2.0), expected = VectorXd::Constant(1, 1.5);
  const Eigen::MatrixXd cov = Eigen::MatrixXd::Constant(1, 1, 0.25), more = 0.5 * cov;
  const double normal =
      -0.5 * (0.25 / 0.375 + std::log(0.375)) + 0.5 * (4.0 / 0.25 + std::log(0.25));
  EXPECT_NEAR(LogRatio(estimate, cov, expected, more, kInfinite), normal, 1e-12);
  EXPECT_NEAR(LogRatio(estimate, cov, expected, more, 1e7), normal, 1e-4);
  EXPECT_EQ(LogRatio(estimate, 0.0 * cov, expected, 0.0 * more, kInfinite), 0.0);
}

Cause CauseOfSize(double value, double sigma) {
  return {{&InfoOf("fix_scale"), {}},
          VectorXd::Constant(1, value),
          VectorXd::Constant(1, sigma),
          1e-9,
          {},
          {},
          {},
          {}};
}

double WitnessOf(double fitted, double shown, double sigma, bool independent = true) {
  Cause cause = CauseOfSize(fitted, 0.01);
  cause.witness = {
      "mocap position", "", VectorXd::Constant(1, shown), VectorXd::Constant(1, sigma), "",
      independent};
  AddIndependentEvidence(&cause);
  return cause.evidence.witness;
}

TEST(IndependentEvidence, AWitnessSpeaksForWhatItShowsAndAgainstWhatItExcludes) {
  EXPECT_GT(WitnessOf(0.1, 0.1, 0.01), 3.0);
  EXPECT_LT(WitnessOf(0.1, 0.0, 0.01), -3.0);
  EXPECT_NEAR(WitnessOf(0.1, 0.05, 1.0), 0.0, 0.05);  // one that can't tell
  EXPECT_GT(WitnessOf(0.1, 0.07, 0.002), 0.0);        // another size is no refutation
  EXPECT_GT(WitnessOf(0.1, -0.001, 0.0001), -20.0);   // and no witness is beyond doubt
  // What the fit has used can't confirm it.
  EXPECT_EQ(WitnessOf(0.1, 0.1, 0.01, false), 0.0);
  EXPECT_LT(WitnessOf(0.1, 0.0, 0.01, false), -3.0);
}

double ChangeOf(double value, const std::vector<double>& references) {
  constexpr double kSigma = 0.01;
  Cause cause = CauseOfSize(value, kSigma);
  for (const double reference : references) {
    cause.repeats.push_back(
        {"reference", "", VectorXd::Constant(1, reference), VectorXd::Constant(1, kSigma)});
  }
  return ChangeEvidence(cause).value();
}

TEST(ChangeEvidence, ShowsASizeThatTheReferencesLack) {
  EXPECT_GT(ChangeOf(0.12, {0.01, 0.02}), 7.5);  // 6 sigmas
  EXPECT_GT(ChangeOf(0.12, {0.0}), 7.5);
  EXPECT_LT(ChangeOf(0.03, {0.01, 0.0}), 2.0);
  EXPECT_LT(ChangeOf(0.12, {0.11, 0.125}), 0.0);       // all have it
  EXPECT_LT(ChangeOf(0.12, {0.2, -0.05, 0.05}), 2.0);  // one of a vehicle that scatters
  EXPECT_FALSE(ChangeEvidence(CauseOfSize(0.1, 0.01)).has_value());
}

TEST(ChangeEvidence, HasAMeanOfOneAtMostWithoutAChange) {
  constexpr int kSeeds = 20000;
  for (const std::size_t references : {1, 2, 5}) {
    Random random(2, "change");
    double mean = 0.0;
    for (int i = 0; i < kSeeds; ++i) {
      std::vector<double> shown(references);
      for (double& size : shown) size = 0.05 + 0.01 * random.Normal();
      mean += std::exp(ChangeOf(0.05 + 0.01 * random.Normal(), shown)) / kSeeds;
    }
    EXPECT_LT(mean, 1.05) << references;
  }
}

// A mean gain of z sigmas, of errors of 1 m before.
Gain GainOf(double z) {
  constexpr double kSigma = 0.05;  // m
  return {.arcs = 20,
          .before = 1.0,
          .after = 1.0 - z * kSigma,
          .low = (z - 1.96) * kSigma,
          .high = (z + 1.96) * kSigma};
}

TEST(HeldOutEvidence, SpeaksAgainstALossAlone) {
  EXPECT_EQ(HeldOutEvidence({GainOf(3.0), {}}), 0.0);
  EXPECT_EQ(HeldOutEvidence({{}, {}}), 0.0);
  EXPECT_NEAR(HeldOutEvidence({GainOf(-3.0), {}}), -4.5, 1e-3);
  // Two measures that agree are surer, and two that differ say nothing.
  EXPECT_NEAR(HeldOutEvidence({GainOf(-3.0), GainOf(-3.0)}), -9.0, 1e-3);
  EXPECT_EQ(HeldOutEvidence({GainOf(-3.0), GainOf(3.0)}), 0.0);
  EXPECT_EQ(HeldOutEvidence({GainOf(-8.0), {}}), HeldOutEvidence({GainOf(-9.0), {}}));
}

// What three clusters say is not what three hundred say, however many others there are.
TEST(ScoreTest, FewClustersThatShareTheInformationShowLess) {
  ScoreTest test = TestOf(0.1, 0.02, 0.02, 303);
  const VectorXd prior = VectorXd::Constant(1, 1.0);
  const double many = FlightEvidenceOf(test, prior);
  test.information.topRows(300) *= 1e-6;
  EXPECT_NEAR(test.Sharing(test.value), 3.0, 0.01);
  EXPECT_LT(FlightEvidenceOf(test, prior), many - 3.0);
}

TEST(PriorEvidence, CountsEffectsAndTheirPlaces) {
  const auto report = [](const std::string& id) {
    CandidateReport r;
    r.id = id;
    return r;
  };
  const std::vector<CandidateReport> tried{report("wind"), report("gate_moved"),
                                           report("gate_moved"), report("gate_moved")};
  EXPECT_NEAR(PriorEvidenceOf("wind", tried), -std::log(2.0), 1e-12);
  EXPECT_NEAR(PriorEvidenceOf("gate_moved", tried), -std::log(6.0), 1e-12);
}

}  // namespace
}  // namespace trueline
