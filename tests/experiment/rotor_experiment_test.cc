// Experiments with rotor-driven flights: shipped ones run, results do not depend on threads, and
// the batch reaches the Cramer-Rao bound if the model is exact.
#include "problems/experiment/rotor_experiment.h"

#include <gmock/gmock.h>

#include <fstream>
#include <set>

#include "problems/common/error.h"
#include "problems/experiment/write_rotor_experiment.h"
#include "problems/result/render.h"
#include "problems/trajectory/trajectory_config.h"
#include "tests/common/bands.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

fs::path Shipped(const std::string& name) {
  return fs::path(TRUELINE_TEST_SOURCE_DIR) / "config/experiments" / (name + ".yaml");
}

RotorExperimentRun RunWith(const RotorExperiment& experiment, int threads = 0) {
  return RunRotorExperiment(experiment, threads, [](const std::string&) {});
}

std::vector<RotorTrial> RunAll(const RotorExperiment& experiment, int threads = 0) {
  return RunWith(experiment, threads).trials;
}

TEST(RotorExperiment, ShippedOnesAreReadAndOthersAreNot) {
  EXPECT_TRUE(IsRotorExperiment(Shipped("rotors_figure3")));
  EXPECT_FALSE(IsRotorExperiment(Shipped("figure11")));
  const RotorExperiment figure3 = ReadRotorExperiment(Shipped("rotors_figure3"));
  EXPECT_EQ(figure3.kinds.size(), 6u);
  EXPECT_TRUE(figure3.simulation.log_commands);
  const RotorExperiment coverage = ReadRotorExperiment(Shipped("rotors_coverage"));
  EXPECT_EQ(coverage.flights, 500);
  EXPECT_EQ(coverage.simulation.drag.norm(), 0.0);
}

TEST(RotorExperiment, ATrialOfThePapersExperimentWritesItsResult) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_matched"));
  ShortenRotorExperiment(&experiment);
  experiment.kinds.resize(2);  // random and Lissajous; the designed ones last 20 s
  const RotorExperimentRun run = RunWith(experiment);
  ASSERT_EQ(run.trials.size(), 4u);
  for (const RotorTrial& trial : run.trials) EXPECT_EQ(trial.failure, "");
  const fs::path out = fs::path(testing::TempDir()) / "trueline_rotor_experiment";
  fs::remove_all(out);
  WriteRotorExperiment(experiment, run, out);
  const YAML::Node summary = YAML::LoadFile((out / "summary.yaml").string());
  ASSERT_EQ(summary["kinds"].size(), 2u);
  EXPECT_EQ(summary["kinds"][0]["flights"].as<int>(), 2);
  EXPECT_TRUE(summary["kinds"][0]["groups"]["r_BP"]["batch"]["rmse"].IsDefined());
  EXPECT_EQ(RenderReport("rotor_experiment", {"--result=" + out.string()}, out), "");
  const PiecewisePolynomial figure = ReadTrajectoryFile(out / "trajectory_best_Lissajous.yaml");
  EXPECT_DOUBLE_EQ(figure.duration(), experiment.duration);
  fs::remove_all(out);
}

TEST(RotorExperiment, ResultsDoNotDependOnThreads) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_coverage"));
  experiment.flights = 2;
  experiment.duration = 3.0;
  const std::vector<RotorTrial> one = RunAll(experiment, 1), two = RunAll(experiment, 2);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(one[i].batch_error, two[i].batch_error);
  EXPECT_NE(one[0].batch_error, one[1].batch_error);
}

// 12 flights of 18 constants: the ratio of RMSE to the bound scatters by about 6 %.
TEST(RotorExperiment, BatchReachesTheBoundAndIntervalsHoldSlow) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_coverage"));
  experiment.flights = 12;
  experiment.duration = 8.0;
  const KindSummary summary = SummariseRotorTrials(experiment, RunAll(experiment)).front();
  EXPECT_EQ(summary.failures, 0);
  EXPECT_NEAR(summary.batch_over_bound, 1.0, 0.2);
  ExpectChiSquare(12 * 18 * summary.batch_nees, 12 * 18, "batch");
  ExpectChiSquare(12 * 18 * summary.filter_nees, 12 * 18, "filter");
  double inside = 0.0;
  for (const ConstantScore& c : summary.constants) inside += c.batch.coverage / 18.0;
  EXPECT_NEAR(inside, 0.95, 0.05);
}

// Squared errors of some constants in stated sigmas, summed over all flights.
double SquaredErrors(const std::vector<RotorTrial>& trials, const std::set<std::string>& names) {
  double sum = 0.0;
  for (const RotorTrial& trial : trials) {
    for (const std::string& name : names) {
      const int i = FindRotorConstant(name);
      sum += std::pow(trial.batch_error[i] / trial.batch_sigma[i], 2);
    }
  }
  return sum;
}

// Drag, rotor differences and a lag that no estimator models: intervals from noise alone miss mass
// and centre of mass; those with considered effects cover them.
TEST(RotorExperiment, SlowIntervalsTakeInWhatTheModelLacks) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_coverage_unmodelled"));
  experiment.flights = 16;
  experiment.duration = 8.0;
  const auto inside = [&](const std::vector<RotorTrial>& trials, const std::set<std::string>& names,
                          EstimatorScore ConstantScore::*estimator) {
    const KindSummary summary = SummariseRotorTrials(experiment, trials).front();
    EXPECT_EQ(summary.failures, 0);
    double sum = 0.0;
    int count = 0;
    for (const ConstantScore& c : summary.constants) {
      if (names.empty() || names.count(c.name) > 0) sum += (c.*estimator).coverage, ++count;
    }
    return sum / count;
  };
  const std::set<std::string> bent = {"m", "r_BM_x", "r_BM_y"};
  const std::vector<RotorTrial> wide = RunAll(experiment);
  EXPECT_NEAR(inside(wide, {}, &ConstantScore::batch), 0.95, 0.05);
  EXPECT_NEAR(inside(wide, {}, &ConstantScore::filter), 0.95, 0.05);
  // Coverage alone accepts intervals of any width; squared errors show that these are no wider than
  // needed.
  EXPECT_GT(inside(wide, bent, &ConstantScore::batch), 0.85);
  ExpectChiSquare(SquaredErrors(wide, bent), 16.0 * bent.size(), "bent constants");
  experiment.considered.clear();
  EXPECT_LT(inside(RunAll(experiment), bent, &ConstantScore::batch), 0.6);
}

TEST(RotorExperiment, WrongOnesAreRefusedByName) {
  const fs::path file = fs::path(testing::TempDir()) / "rotor_experiment.yaml";
  std::ifstream shipped(Shipped("rotors_coverage"));
  std::ofstream(file) << shipped.rdbuf()
                      << "  - {name: designed, kind: file, file: nowhere.yaml}\n";
  try {
    ReadRotorExperiment(file);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("nowhere.yaml"), HasSubstr("file")));
  }
  fs::remove(file);
}

}  // namespace
}  // namespace trueline
