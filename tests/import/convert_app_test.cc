// trueline-convert as a user runs it: exit codes, table, silence.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <cstdlib>
#include <sstream>

#include "tests/import/import_files.h"

namespace trueline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Outcome {
  int exit_code;
  std::string out, err;
};

std::string TextOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class ConvertApp : public testing::Test {
 protected:
  void SetUp() override {
    program_ = std::string(TRUELINE_TEST_APPS_DIR) + "/trueline-convert";
    if (!std::filesystem::exists(program_)) GTEST_SKIP() << program_ << " is not built";
    map_ = files_.Write("map.yaml",
                        "inputs: {log: {time: {column: t}}}\n"
                        "streams:\n"
                        "  imu: {accel: {columns: [a, a, a]}, gyro: {columns: [a, a, a]}}\n"
                        "  mocap: {position: {columns: [x, a, a]},\n"
                        "          euler: {roll: a, pitch: a, yaw: a}}\n"
                        "fixes_from_mocap: {min_count: 15, max_count: 20}\n");
    std::string csv = "t,a,x\n";
    for (int i = 0; i < 400; ++i) csv += fmt::format("{},0,{}\n", 0.01 * i, 0.01 * i);
    csv_ = files_.Write("log.csv", csv);
    out_ = files_.Write("out", "");
    std::filesystem::remove(out_);
  }

  Outcome Run(const std::string& arguments) const {
    const std::string out = files_.Write("stdout", "");
    const std::string err = files_.Write("stderr", "");
    const int status =
        std::system(fmt::format("'{}' {} >'{}' 2>'{}'", program_, arguments, out, err).c_str());
    return {WEXITSTATUS(status), TextOf(out), TextOf(err)};
  }
  std::string Usual() const {
    return fmt::format("--map='{}' --in='{}' --out='{}'", map_, csv_, out_);
  }

  ImportFiles files_;
  std::string program_, map_, csv_, out_;
};

TEST_F(ConvertApp, WritesALogAndPrintsItsStreams) {
  const Outcome done = Run(Usual());
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("imu             400      100.00"), HasSubstr("fixes"),
                              HasSubstr("1 gates")));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/log.yaml"));
}

TEST_F(ConvertApp, IsQuietWhereAsked) {
  const Outcome done = Run(Usual() + " --quiet");
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.out + done.err, IsEmpty());
}

TEST_F(ConvertApp, RepeatsWithTheSeed) {
  const auto fixes = [&](int seed) {
    Run(fmt::format("{} --seed={}", Usual(), seed));
    return TextOf(out_ + "/fixes.csv");
  };
  const std::string first = fixes(1);
  EXPECT_EQ(first, fixes(1));
  EXPECT_NE(first, fixes(2));
}

TEST_F(ConvertApp, TakesSettingsOfFixesFromFlags) {
  Run(Usual() +
      " --straights='1<x<3' --sigma_factor=0 --sigma_floor=0.01 --min_count=7 "
      "--max_count=7");
  std::istringstream fixes(TextOf(out_ + "/fixes.csv"));
  int lines = 0;
  for (std::string line; std::getline(fixes, line); ++lines) {
    EXPECT_THAT(line, testing::EndsWith(lines == 0 ? "gate [1]" : ",0.01,0"));
  }
  EXPECT_EQ(lines, 8);
}

TEST_F(ConvertApp, RefusesBadInput) {
  const Outcome none = Run("");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("--map, --in and --out are needed"));
  files_.Write("log.csv", "t,a,x\n1,0,0\n0,0,0\n");
  const Outcome unsorted = Run(Usual());
  EXPECT_EQ(unsorted.exit_code, 2);
  EXPECT_THAT(unsorted.err, HasSubstr("log.csv:3: column 't'"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(ConvertApp, TeachesByExample) {
  EXPECT_THAT(Run("--helpshort").out,
              AllOf(HasSubstr("trueline-convert --map=config/import/nanobench.yaml"),
                    HasSubstr("--straights='-0.9<x<0.9'"), HasSubstr("sigma_factor")));
}

}  // namespace
}  // namespace trueline
