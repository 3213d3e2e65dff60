#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "problems/common/error.h"
#include "problems/observability/design.h"
#include "problems/trajectory/trajectory_config.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;
const fs::path kDesignConfigs = TRUELINE_TEST_SOURCE_DIR "/config/design";
const auto kSilent = [](const std::string&) {};

TEST(DesignConfig, SlowEveryFileThatShipsIsReadAndCanBegin) {
  for (const auto& entry : fs::directory_iterator(kDesignConfigs)) {
    DesignTask task = ReadDesignTask(YamlMap::FromFile(entry.path()), 0, 1);
    task.options.shape.duration = 4.0;
    task.options.shape.pieces = 16;
    task.options.candidates = task.options.starts = task.options.iterations = 1;
    task.options.check_step = 0.01;
    task.compare = 0;
    if (auto* gramian = std::get_if<GramianCriterion>(&task.criterion)) gramian->scale.flights = 1;
    if (auto* bound = std::get_if<BoundDesign>(&task.criterion)) {
      bound->duration = 4.0;
      bound->simulation.imu_rate = 100.0;
      bound->evaluations = 12;
      bound->candidates = 3;
    }
    const DesignOutcome outcome = RunDesignTask(task, kSilent);
    EXPECT_GT(outcome.result.score, 0.0) << entry.path();
    EXPECT_LE(outcome.result.use.worst, 1.0) << entry.path();
  }
}

TEST(DesignConfig, AParameterNamedTwiceIsAskedForOnce) {
  YAML::Node file = YAML::LoadFile((kDesignConfigs / "quick.yaml").string());
  file["free"] = std::vector<std::string>{"m", "r_BI_z", "r_BI_z"};
  const DesignTask task = ReadDesignTask(YamlMap(file, "d.yaml", ""), 0, 1);
  std::vector<int> asked = std::get<GramianCriterion>(task.criterion).target.asked;
  EXPECT_EQ(asked.size(), 31u);
  std::sort(asked.begin(), asked.end());
  EXPECT_TRUE(std::adjacent_find(asked.begin(), asked.end()) == asked.end());
}

const DesignTask& Quick() {
  static const DesignTask task =
      ReadDesignTask(YamlMap::FromFile(kDesignConfigs / "quick.yaml"), 3, 2);
  return task;
}
const DesignOutcome& Designed() {
  static const DesignOutcome outcome = RunDesignTask(Quick(), kSilent);
  return outcome;
}

TEST(QuickDesign, BeatsItsStartAndTheRandomFlights) {
  EXPECT_GT(Designed().result.score, 1.3 * Designed().result.start_score);
  EXPECT_GT(Designed().result.score, Designed().random_scores.back());
  EXPECT_GT(Designed().result.score, Designed().lissajous_scores.back());
}

TEST(QuickDesign, KeepsAllLimitsBetweenTheGridPointsToo) {
  const RotorFlight flight(Quick().vehicle, Designed().result.path);
  EXPECT_LE(CheckLimits(flight, Quick().options.limits, 0.000713).worst, 1.0 + 1e-6);
}

TEST(QuickDesign, StartsAndEndsAtRestInTheSamePlace) {
  const PiecewisePolynomial& path = Designed().result.path;
  const FlatMatrix start = path.Expand(path.start(), 3);
  const FlatMatrix end = path.ExpandPiece(path.num_pieces() - 1, path.end(), 3);
  EXPECT_LT((start.col(0) - end.col(0)).norm(), 1e-9);
  EXPECT_LT(start.rightCols(3).norm() + end.rightCols(3).norm(), 1e-6);
}

TEST(QuickDesign, SameSeedGivesTheSameFlightOnAnyNumberOfThreads) {
  DesignTask again = Quick();
  again.options.threads = 1;
  again.compare = 0;
  EXPECT_EQ(RunDesignTask(again, kSilent).result.score, Designed().result.score);
}

TEST(QuickDesign, TrajectoryFileComesBackExactly) {
  const TestFolder folder;
  DesignTask task = Quick();
  task.source = "designs/\"quick\": 3 # \\.yaml";
  WriteDesign(task, Designed(), folder.directory());
  const PiecewisePolynomial back = ReadTrajectoryFile(folder / "trajectory.yaml");
  ASSERT_EQ(back.num_pieces(), Designed().result.path.num_pieces());
  EXPECT_EQ(back.Expand(2.345, 3), Designed().result.path.Expand(2.345, 3));
  std::ifstream csv(folder / "trajectory.csv");
  std::string header, line;
  std::getline(csv, header);
  int rows = 0;
  while (std::getline(csv, line)) ++rows;
  EXPECT_THAT(header, HasSubstr(",w4 [rad/s]"));
  EXPECT_EQ(rows, 601);  // 6 s at 100 Hz
  const YAML::Node score = YAML::LoadFile((folder / "score.yaml").string());
  EXPECT_TRUE(score["score"].IsDefined());
  EXPECT_EQ(score["provenance"]["source"].as<std::string>(), task.source);
}

void ExpectRefused(const std::string& key, const std::string& value, const std::string& part,
                   const char* shipped = "quick.yaml") {
  YAML::Node node = YAML::LoadFile((kDesignConfigs / shipped).string());
  node[key] = YAML::Load(value);
  EXPECT_THAT(ErrorOf([&] { ReadDesignTask(YamlMap(node, "d.yaml", ""), 0, 1); }), HasSubstr(part))
      << key << ": " << value;
}

TEST(DesignConfig, MistakesAreNamed) {
  ExpectRefused("show", "[theta_x]", "is no constant");
  ExpectRefused("show", "[k_f]", "name it under 'free'");
  ExpectRefused("show", "[]", "names nothing");
  ExpectRefused("duration", "0.5", "must be in [2, 120] s");
  ExpectRefused("limits", "{tilt: 2.0}", "must be in (0, pi/2) rad");
  ExpectRefused("limits", "{speed: 2.0}", "unknown key");
  ExpectRefused("starts", "0", "must be at least 1");
  ExpectRefused("criterion", "size", "gramian, bound");
  const char* by_bound = "sensor_position_bound.yaml";
  ExpectRefused("show", "[k_f]", "give it a sigma under 'prior'", by_bound);
  ExpectRefused("show", "[nose]", "is no constant", by_bound);
  ExpectRefused("show", "[]", "names nothing", by_bound);
  ExpectRefused("ramp", "12", "at most 0.4 of the duration", by_bound);
  ExpectRefused("starts", "2", "unknown key", by_bound);
}

}  // namespace
}  // namespace trueline
