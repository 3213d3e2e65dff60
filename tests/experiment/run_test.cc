// Runs: the same bytes for any number of threads and after a kill; failures stay with their flight.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>

#include "problems/common/progress.h"
#include "problems/experiment/rotor_experiment.h"
#include "problems/log/native_log.h"
#include "problems/prediction/prediction_experiment.h"
#include "problems/simulation/simulate.h"
#include "tests/common/matchers.h"
#include "tests/experiment/short_experiment.h"

namespace trueline::testing_benchmark {
namespace {

std::string ThreeFlights() {
  return Hippodrome() +
         "    randomise: true\n"
         "estimators:\n  - {name: vgd, label: VGD}\n  - {name: ekf, label: EKF}\n"
         "seeds: {first: 3, count: 3}\ngammas: [1, 2]\n"
         "convergence: {b_az: 0.5, final_point_error: 3.0}\n"
         "starts: {count: 2}\ntrajectories: true\nbound: VGD\n";
}

const std::vector<std::string> kTables = {"arcs.csv", "summary.yaml", "convergence.csv",
                                          "starts.csv", "trajectory.csv"};

std::vector<fs::path> JobFiles(const fs::path& out) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(out / "jobs")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

// One run for all tests, on one thread.
class SlowRun : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    file_ = WriteExperiment(folder_->path(), ThreeFlights());
    RunFile(file_, folder_->path() / "one", 1);
    for (const std::string& table : kTables) {
      expected_[table] = ReadText(folder_->path() / "one" / table);
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static void ExpectSame(const fs::path& out) {
    for (const std::string& table : kTables) {
      EXPECT_GT(expected_[table].size(), 100U) << table;
      EXPECT_EQ(ReadText(out / table), expected_[table]) << table;
    }
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  static fs::path file_;
  static std::map<std::string, std::string> expected_;
};
std::unique_ptr<TemporaryFolder> SlowRun::folder_;
fs::path SlowRun::file_;
std::map<std::string, std::string> SlowRun::expected_;

TEST_F(SlowRun, GivesTheSameBytesOnTwoThreads) {
  const fs::path out = folder_->path() / "two";
  const ExperimentRun run = RunFile(file_, out, 2);
  EXPECT_EQ(run.reused, 0);
  ExpectSame(out);
  const std::string brief = BenchmarkBrief(run);
  EXPECT_EQ(std::ranges::count(brief, '\n'), 12) << brief;  // heads, three errors, six times
  EXPECT_THAT(brief, HasSubstr("b_az < 0.5"));
}

TEST_F(SlowRun, GoesOnWhereItWasKilled) {
  const fs::path out = folder_->path() / "killed";
  fs::create_directories(out);
  fs::copy(folder_->path() / "one" / "jobs", out / "jobs");
  const auto files = JobFiles(out);
  ASSERT_EQ(files.size(), 3U);
  fs::remove(files[0]);                                    // was not reached
  fs::resize_file(files[1], fs::file_size(files[1]) / 2);  // as after a disk failure
  EXPECT_EQ(RunFile(file_, out, 1).reused, 1);
  ExpectSame(out);
  EXPECT_EQ(RunFile(file_, out, 1).reused, 3);
  ExpectSame(out);
}

TEST_F(SlowRun, ReusesNothingOfAnotherExperiment) {
  const TemporaryFolder other;
  fs::copy(folder_->path() / "one" / "jobs", other.path() / "jobs");
  std::string text = ThreeFlights();
  text.replace(text.find("b_az: 0.5"), 9, "b_az: 0.4");
  const fs::path file = WriteExperiment(other.path(), text);
  EXPECT_EQ(RunFile(file, other.path(), 1).reused, 0);
}

TEST_F(SlowRun, TablesHoldEveryArcOfEveryFlight) {
  std::map<std::string, int> count;
  std::istringstream lines(expected_["arcs.csv"]);
  std::string line;
  std::getline(lines, line);
  EXPECT_THAT(line, HasSubstr("log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error "
                              "[m],predicted_sigma [m],iterations [1],solve_time [s]"));
  while (std::getline(lines, line)) {
    ++count[line.substr(0, line.find(',', line.find(',', line.find(',') + 1) + 1))];
  }
  EXPECT_EQ(count.size(), 3U);  // the EKF has no windows: once
  EXPECT_EQ(count["hippodrome,vgd,1"], count["hippodrome,vgd,2"]);
  EXPECT_EQ(count["hippodrome,vgd,1"], count["hippodrome,ekf,1"]);
  EXPECT_GE(count["hippodrome,vgd,1"], 12);
  const YAML::Node summary = YAML::Load(expected_["summary.yaml"]);
  ASSERT_EQ(summary["groups"].size(), 3U);
  EXPECT_EQ(summary["groups"][0]["flights"].as<int>(), 3);
  EXPECT_EQ(summary["groups"][0]["arcs"].as<int>(), count["hippodrome,vgd,1"]);
  EXPECT_GT(summary["groups"][0]["bound_rms_m"].as<double>(), 0.05);
  EXPECT_EQ(summary["provenance"]["seeds"]["first"].as<int>(), 3);
}

TEST(Failure, OfOneFlightLeavesTheOthers) {
  const TemporaryFolder folder;
  const fs::path file = WriteExperiment(
      folder.path(), Hippodrome() +
                         "estimators: [{name: vgd}]\n"
                         "sweep: {name: speed, keys: [simulation.vehicle.max_rotor_speed], values: "
                         "[1300, 700]}\n");
  const ExperimentRun run = RunFile(file, folder.path() / "out", 1);
  ASSERT_EQ(run.outcomes.size(), 2U);
  EXPECT_EQ(run.outcomes[0].failure, "");
  EXPECT_THAT(run.outcomes[1].failure, HasSubstr("left the course"));
  EXPECT_EQ(JobFiles(folder.path() / "out").size(), 1U);
  EXPECT_THAT(ReadText(folder.path() / "out/summary.yaml"), HasSubstr("left the course"));
}

TEST(Failure, OfAFlightWithoutPassesSaysSo) {
  const TemporaryFolder folder;
  const std::string vgd = "estimators: [{name: vgd}]\n";
  const auto job =
      MakeJobs(ReadExperiment(WriteExperiment(folder.path(), Hippodrome() + vgd))).front();
  SimulationTruth truth;
  FlightLog log = Simulate(std::get<SimulationConfig>(job.flight), 1, &truth);
  log.fixes.resize(1);  // a pass has more
  WriteNativeLog(log, folder.path() / "log");
  const fs::path file = WriteExperiment(folder.path(), "logs: [{log: log}]\n" + vgd);
  const ExperimentRun run = RunFile(file, folder.path() / "out", 1);
  ASSERT_EQ(run.outcomes.size(), 1U);
  EXPECT_THAT(run.outcomes[0].failure, HasSubstr("no pass to fit"));
}

TEST(JobFile, ReadsBackWhatItWrote) {
  JobResult result;
  ArcRow arc;
  arc.label = "VGD as published";
  arc.estimator = "vgd";
  arc.truth = "mocap";
  arc.error = 0.1 + 0.2;
  arc.bound = std::nan("");
  result.arcs = {arc};
  result.convergence = {{"EKF", 3, "b_az", 0.1, 20, std::nan("")}};
  const JobResult back = ParseJobResult(ToText(result), "file");
  EXPECT_EQ(back.arcs[0].label, arc.label);
  EXPECT_EQ(back.arcs[0].error, arc.error);
  EXPECT_TRUE(std::isnan(back.arcs[0].bound));
  EXPECT_TRUE(std::isnan(back.convergence[0].time));
}

TEST(ProgressText, StatesTheTimeLeft) {
  EXPECT_EQ(Progress::Text(25, 100, "flights", 10.0), "25 of 100 flights, 30 s left");
  EXPECT_EQ(Progress::Text(1, 100, "flights", 10.0), "1 of 100 flights, 17 min left");
}

// --- Every experiment that ships runs, in its short form.

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
