// Experiments with rotor-driven flights: shipped ones run, results do not depend on threads, and
// the batch reaches the Cramer-Rao bound if the model is exact.
#include "problems/experiment/rotor_experiment.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "problems/common/error.h"
#include "problems/experiment/write_benchmark.h"
#include "problems/result/render.h"
#include "problems/trajectory/trajectory_config.h"
#include "tests/common/bands.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

fs::path Shipped(const std::string& name) {
  return fs::path(TRUELINE_TEST_SOURCE_DIR) / "config/experiments" / (name + ".yaml");
}

ExperimentRun RunAll(const RotorExperiment& experiment, int threads = 0,
                     const fs::path& jobs_folder = {}) {
  return RunJobs(MakeRotorJobs(experiment, jobs_folder, threads, true), jobs_folder, threads, true);
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
  const ExperimentRun run = RunAll(experiment);
  ASSERT_EQ(run.outcomes.size(), 4u);
  for (const JobOutcome& outcome : run.outcomes) EXPECT_EQ(outcome.failure, "");
  const TestFolder folder;
  const fs::path out = folder / "out";
  WriteRotorExperiment(experiment, run, out);
  const YAML::Node summary = YAML::LoadFile((out / "summary.yaml").string());
  ASSERT_EQ(summary["kinds"].size(), 2u);
  EXPECT_EQ(summary["kinds"][0]["flights"].as<int>(), 2);
  EXPECT_TRUE(summary["kinds"][0]["groups"]["r_BP"]["batch"]["rmse"].IsDefined());
  EXPECT_EQ(RunReport("rotor_experiment", {"--result=" + out.string()}, out / "report.html"), "");
  const std::string whole = RotorExperimentTable(experiment, run);
  const std::string shown = OneScreen(whole, RotorExperimentBrief(experiment, run), false);
  EXPECT_EQ(OneScreen(whole, "", true), whole);
  EXPECT_EQ(std::ranges::count(shown, '\n'), 4) << shown;  // a head, two kinds, how to see more
  EXPECT_NE(shown.find("best Lissajous"), std::string::npos) << shown;
  const PiecewisePolynomial figure = ReadTrajectoryFile(out / "trajectory_best_Lissajous.yaml");
  EXPECT_DOUBLE_EQ(figure.duration(), experiment.duration);
}

TEST(RotorExperiment, ResultsDoNotDependOnThreads) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_coverage"));
  experiment.flights = 2;
  experiment.duration = 3.0;
  const ExperimentRun one = RunAll(experiment, 1), two = RunAll(experiment, 2);
  const auto error = [](const ExperimentRun& run, int i) {
    return run.outcomes[i].result.trials.front().batch.error;
  };
  for (int i = 0; i < 2; ++i) EXPECT_EQ(error(one, i), error(two, i));
  EXPECT_NE(error(one, 0), error(one, 1));
}

TEST(RotorExperiment, SlowGoesOnWhereItWasKilledWithTheSameBytes) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_matched"));
  ShortenRotorExperiment(&experiment);
  experiment.duration = 3.0;
  experiment.kinds.resize(2);  // random and Lissajous
  const TestFolder folder;
  const fs::path out = folder / "out";
  const auto run = [&](int reused) {
    const ExperimentRun result = RunAll(experiment, 1, out / "jobs");
    EXPECT_EQ(result.reused, reused);
    WriteRotorExperiment(experiment, result, out);
    std::string text;
    for (const char* name :
         {"summary.yaml", "trials.csv", "history.csv", "trajectory_best_Lissajous.yaml"}) {
      const std::string content = ReadText(out / name);
      EXPECT_GT(content.size(), 100u) << name;
      text += content;
    }
    return text;
  };
  const std::string whole = run(0);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(out / "jobs")) files.push_back(entry.path());
  ASSERT_EQ(files.size(), 6u);  // two kinds, four flights
  const Job last = MakeRotorJobs(experiment, out / "jobs", 1, true).back();
  fs::resize_file(out / "jobs" / (last.key + ".txt"), 1000);  // as after a disk failure
  EXPECT_EQ(run(3), whole);
  EXPECT_EQ(run(4), whole);
}

// 12 flights of 18 constants: the ratio of RMSE to the bound scatters by about 6 %.
TEST(RotorExperiment, BatchReachesTheBoundAndIntervalsHoldSlow) {
  RotorExperiment experiment = ReadRotorExperiment(Shipped("rotors_coverage"));
  experiment.flights = 12;
  experiment.duration = 8.0;
  const KindSummary summary = SummariseTrials(experiment, RunAll(experiment).outcomes).front();
  EXPECT_EQ(summary.failures, 0);
  EXPECT_NEAR(summary.batch_over_bound, 1.0, 0.2);
  ExpectChiSquare(12 * 18 * summary.batch_nees, 12 * 18, "batch");
  ExpectChiSquare(12 * 18 * summary.filter_nees, 12 * 18, "filter");
  double inside = 0.0;
  for (const ConstantScore& c : summary.constants) inside += c.batch.coverage / 18.0;
  EXPECT_NEAR(inside, 0.95, 0.05);
}

// Squared errors of some constants in stated sigmas, summed over all flights.
double SquaredErrors(const std::vector<const TrialRow*>& trials,
                     const std::set<std::string>& names) {
  double sum = 0.0;
  for (const TrialRow* trial : trials) {
    for (const std::string& name : names) {
      const int i = FindRotorConstant(name);
      sum += std::pow(trial->batch.error[i] / trial->batch.sigma[i], 2);
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
  const auto inside = [&](const ExperimentRun& run, const std::set<std::string>& names,
                          EstimatorScore ConstantScore::*estimator) {
    const KindSummary summary = SummariseTrials(experiment, run.outcomes).front();
    EXPECT_EQ(summary.failures, 0);
    double sum = 0.0;
    int count = 0;
    for (const ConstantScore& c : summary.constants) {
      if (names.empty() || names.count(c.name) > 0) sum += (c.*estimator).coverage, ++count;
    }
    return sum / count;
  };
  const std::set<std::string> bent = {"m", "r_BM_x", "r_BM_y"};
  const ExperimentRun wide = RunAll(experiment);
  EXPECT_NEAR(inside(wide, {}, &ConstantScore::batch), 0.95, 0.05);
  EXPECT_NEAR(inside(wide, {}, &ConstantScore::filter), 0.95, 0.05);
  // Coverage alone accepts intervals of any width; squared errors show that these are no wider than
  // needed.
  EXPECT_GT(inside(wide, bent, &ConstantScore::batch), 0.85);
  ExpectChiSquare(SquaredErrors(TrialsOf(wide.outcomes, experiment.kinds.front().name), bent),
                  16.0 * bent.size(), "bent constants");
  experiment.considered.clear();
  EXPECT_LT(inside(RunAll(experiment), bent, &ConstantScore::batch), 0.6);
}

TEST(RotorExperiment, WrongOnesAreRefusedByName) {
  const TestFolder folder;
  const fs::path file = folder / "rotor_experiment.yaml";
  std::ofstream(file) << ReadText(Shipped("rotors_coverage"))
                      << "  - {name: designed, kind: file, file: nowhere.yaml}\n";
  EXPECT_THAT(ErrorOf([&] { ReadRotorExperiment(file); }),
              AllOf(HasSubstr("nowhere.yaml"), HasSubstr("file")));
}

}  // namespace
}  // namespace trueline
