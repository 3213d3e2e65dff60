// Reading runs: plain or compressed, and what is refused.
#include <zlib.h>

#include <array>
#include <fstream>

#include "problems/prediction/prediction_run.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace {

std::string RunText(int rows, double step = 0.01) {
  std::string text =
      "t,x,y,z,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz,m1_rads,m2_rads,m3_rads,m4_rads,ax_body\n";
  for (int i = 0; i < rows; ++i) {
    text += fmt::format("{},1,2,3,0,0,0.6,0.8,4,5,6,7,8,9,101,102,103,{},0\n", i * step, 104 + i);
  }
  return text;
}

void Write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

TEST(ReadRuns, PlainAndCompressedAlike) {
  const TestFolder folder;
  Write(folder / "melon_a.csv", RunText(60));
  WriteCompressed(folder / "melon_b.csv.gz", RunText(60));
  Write(folder / "notes.txt", "no run");
  const auto runs = ReadPredictionRuns(folder.directory());
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[1].name, "melon_b");
  EXPECT_EQ(runs[1].trajectory, "melon");
  EXPECT_EQ(runs[0].states, runs[1].states);
  EXPECT_EQ(runs[0].num_windows(), 10);
  Eigen::Matrix<double, 13, 1> state;
  state << 1, 2, 3, 4, 5, 6, 0.8, 0, 0, 0.6, 7, 8, 9;  // w first in memory, last in the file
  EXPECT_EQ(runs[0].states.col(0), state);
  EXPECT_EQ(runs[0].speeds(3, 2), 106.0);
}

TEST(ReadRuns, RunsOfOneTrajectoryDifferByTheirNumber) {
  for (const auto& [names, trajectory] : {std::pair{std::array{"melon_1", "melon_2"}, "melon"},
                                          {{"Melon run 1", "Melon run 2"}, "Melon"},
                                          {{"melon-1", "melon-2"}, "melon"},
                                          {{"run1", "run2"}, "run"}}) {
    const TestFolder folder;
    for (const char* name : names) Write(folder / fmt::format("{}.csv", name), RunText(60));
    for (const PredictionRun& run : ReadPredictionRuns(folder.directory())) {
      EXPECT_EQ(run.trajectory, trajectory) << run.name;
    }
  }
}

TEST(ReadRuns, RefusesWhatIsNoRun) {
  const TestFolder folder;
  const auto error = [&] { return ErrorOf([&] { ReadPredictionRuns(folder.directory()); }); };
  EXPECT_THAT(error(), HasSubstr("no .csv or .csv.gz"));
  Write(folder / "a.csv", RunText(50));
  EXPECT_THAT(error(), HasSubstr("has 50 rows; one window needs 51"));
  Write(folder / "a.csv", RunText(60, 0.02));
  EXPECT_THAT(error(), HasSubstr("a.csv:3: t [s] must grow by 0.01"));
  Write(folder / "a.csv", "t,x\n0,1\n");
  EXPECT_THAT(error(), HasSubstr("has no column 'y'"));
  std::string broken = RunText(60);
  Write(folder / "a.csv", broken.replace(broken.rfind(",9,"), 3, ",?,"));
  EXPECT_THAT(error(), HasSubstr("a.csv:61: column 'wz' holds no finite number"));
}

TEST(ReadRuns, RefusesCutOffCompression) {
  const TestFolder folder;
  WriteCompressed(folder / "a.csv.gz", RunText(600));
  std::filesystem::resize_file(folder / "a.csv.gz",
                               std::filesystem::file_size(folder / "a.csv.gz") / 2);
  EXPECT_THAT(ErrorOf([&] { ReadPredictionRuns(folder.directory()); }), HasSubstr("cut off"));
}

}  // namespace
}  // namespace trueline
