// The NanoDrone experiment in its short form: files, table, page, and what is refused.
#include "problems/prediction/multi_step_experiment.h"

#include <fstream>

#include "problems/result/render.h"
#include "tests/common/test_files.h"
#include "tests/prediction/made_run.h"

namespace trueline::testing_prediction {
namespace {

MultiStepExperiment ShortNanoDrone() {
  MultiStepExperiment experiment = ReadMultiStepExperiment(
      std::filesystem::path(TRUELINE_TEST_SOURCE_DIR) / "config/experiments/nanodrone.yaml");
  ShortenMultiStepExperiment(&experiment);
  return experiment;
}

void WriteMade(const std::filesystem::path& file, int seed) {
  const PredictionRun run = RunOfModel("made", SmallNumbers(), seed);
  std::filesystem::create_directories(file.parent_path());
  std::ofstream out(file);
  out.precision(12);
  out << "t,x,y,z,vx,vy,vz,qw,qx,qy,qz,wx,wy,wz,m1_rads,m2_rads,m3_rads,m4_rads\n";
  for (Eigen::Index i = 0; i < run.states.cols(); ++i) {
    out << 0.01 * static_cast<double>(i);
    for (int a = 0; a < 13; ++a) out << ',' << run.states(a, i);
    for (int a = 0; a < 4; ++a) out << ',' << run.speeds(a, i);
    out << '\n';
  }
}

TEST(MultiStepExperiment, LeavesOneTrajectoryOutAndWritesItsFiles) {
  const TestFolder folder;
  for (int i = 0; i < 4; ++i) {
    WriteMade(folder.directory() / "train" / fmt::format("{}_{}.csv", i < 2 ? "one" : "two", i), i);
  }
  const MultiStepExperiment experiment = ShortNanoDrone();
  const MultiStepResult result = RunMultiStepExperiment(experiment, folder / "train", {}, 2, true);
  ASSERT_EQ(result.folds.size(), 2u);
  EXPECT_EQ(result.folds[0].trained_on, std::vector<std::string>{"two"});
  EXPECT_EQ(result.rows.size(), 8u);  // four predictors on each
  WriteMultiStep(experiment, result, folder / "out");
  const YAML::Node summary = YAML::LoadFile((folder / "out" / "summary.yaml").string());
  EXPECT_EQ(summary["scores"].size(), 8u);
  EXPECT_EQ(summary["fit"]["numbers"]["I_x"]["unit"].as<std::string>(), "kg m^2");
  EXPECT_EQ(summary["published"].size(), experiment.published.size());
  EXPECT_EQ(RunReport("multi_step", {"--result=" + (folder / "out").string()},
                      folder / "out/report.html"),
            "");
  EXPECT_THAT(MultiStepTable(experiment, result), HasSubstr("rotor by rotor"));
}

TEST(MultiStepExperiment, TestsOnAnotherFolderAndNeverOnTheTrained) {
  const TestFolder folder;
  WriteMade(folder.directory() / "train" / "one_1.csv", 1);
  WriteMade(folder.directory() / "train" / "one_2.csv", 2);
  WriteMade(folder.directory() / "test" / "melon_1.csv", 3);
  const MultiStepExperiment experiment = ShortNanoDrone();
  const MultiStepResult result =
      RunMultiStepExperiment(experiment, folder / "train", folder / "test", 2, true);
  EXPECT_TRUE(result.folds.empty());
  ASSERT_EQ(result.rows.size(), 4u);
  EXPECT_EQ(result.rows[3].trajectory, "melon");
  WriteMade(folder.directory() / "test" / "melon_2.csv", 1);
  const auto error = [&](const std::filesystem::path& test) {
    return ErrorOf([&] { RunMultiStepExperiment(experiment, folder / "train", test, 2, true); });
  };
  EXPECT_THAT(error(folder / "test"), HasSubstr("melon_2 starts as a part of one_1 of --data"));
  EXPECT_THAT(error({}), HasSubstr("holds one trajectory only"));
}

}  // namespace
}  // namespace trueline::testing_prediction
