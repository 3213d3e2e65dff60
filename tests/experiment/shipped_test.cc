// Every experiment that ships runs, in its short form.
#include <gtest/gtest.h>

#include <cstdlib>

#include "problems/common/error.h"
#include "problems/experiment/rotor_experiment.h"
#include "problems/prediction/prediction_experiment.h"
#include "tests/experiment/short_experiment.h"

namespace trueline::testing_benchmark {
namespace {

class ShippedSlow : public ::testing::TestWithParam<std::string> {};

bool UseMeasuredFlights() {
  const fs::path fallback = SourceFolder() / "../shared/data";
  if (std::getenv("TRUELINE_DATA") == nullptr) setenv("TRUELINE_DATA", fallback.c_str(), 1);
  return fs::is_directory(fs::path(std::getenv("TRUELINE_DATA")) / "nanobench");
}

TEST_P(ShippedSlow, GivesArcsOfEveryEstimatorOnEveryFlight) {
  const fs::path file = SourceFolder() / "config/experiments" / (GetParam() + ".yaml");
  const bool needs_data = ReadText(file).find("TRUELINE_DATA}") != std::string::npos;
  if (needs_data && !UseMeasuredFlights()) GTEST_SKIP() << "no measured flights: set TRUELINE_DATA";
  Experiment experiment = ReadExperiment(file);
  ShortenExperiment(&experiment);
  const TemporaryFolder out;
  const ExperimentRun run = RunJobs(MakeJobs(experiment), out.path() / "jobs", 0, true);
  for (const JobOutcome& outcome : run.outcomes) {
    SCOPED_TRACE(outcome.job.log);
    EXPECT_EQ(outcome.failure, "");
    std::map<std::string, int> arcs;
    for (const ArcRow& row : outcome.result.arcs) ++arcs[row.label];
    for (const EstimatorSource& estimator : experiment.estimators) {
      EXPECT_GE(arcs[estimator.label], 1) << estimator.label;
    }
  }
  WriteBenchmark(experiment, run, 1, true, out.path());
  EXPECT_TRUE(fs::exists(out.path() / "summary.yaml"));
}

std::vector<std::string> ExperimentNames() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(SourceFolder() / "config/experiments")) {
    if (entry.path().extension() != ".yaml") continue;
    if (IsRotorExperiment(entry.path())) continue;        // rotor_experiment_test.cc runs those
    if (!ExperimentKind(entry.path()).empty()) continue;  // tests/prediction runs those
    names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Experiments, ShippedSlow, ::testing::ValuesIn(ExperimentNames()),
                         [](const auto& shipped) { return shipped.param; });

}  // namespace
}  // namespace trueline::testing_benchmark
