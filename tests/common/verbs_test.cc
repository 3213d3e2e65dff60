#include "problems/common/verbs.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace trueline {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct RunResult {
  int exit_code;
  std::string output;
};

RunResult RunShell(const std::string& command) {
  RunResult result{-1, ""};
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  char buffer[256];
  while (fgets(buffer, sizeof buffer, pipe)) result.output += buffer;
  result.exit_code = WEXITSTATUS(pclose(pipe));
  return result;
}

// Two folders with small programs as verbs.
class Verbs : public ::testing::Test {
 protected:
  Verbs() : root_(fs::temp_directory_path() / ("trueline_verbs_" + std::to_string(getpid()))) {
    AddProgram("first", "trueline-measure", "echo 'trueline-measure: Measures it. With care.'");
    AddProgram("first", "trueline-repeat", "printf '[%s]' \"$@\"; exit 3");
    AddProgram("second", "trueline-measure", "echo hidden");
    AddProgram("second", "trueline-paint", "true");
    std::ofstream(root_ / "first/trueline-notes") << "not a program\n";
  }
  ~Verbs() override { fs::remove_all(root_); }

  void AddProgram(const std::string& folder, const std::string& name, const std::string& script) {
    fs::create_directories(root_ / folder);
    const fs::path path = root_ / folder / name;
    std::ofstream(path) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(path, fs::perms::owner_all);
  }
  RunResult RunTrueline(const std::string& arguments) const {
    return RunShell("PATH='" + (root_ / "first").string() +
                    "':\"$PATH\" '" TRUELINE_TEST_APPS_DIR "/trueline' " + arguments);
  }

  fs::path root_;
};

TEST_F(Verbs, AreExecutablesByNameAndTheFirstFolderWins) {
  const auto verbs = FindVerbs({root_ / "first", root_ / "absent", root_ / "second"});
  EXPECT_THAT(verbs,
              ::testing::ElementsAre(::testing::Pair("measure", root_ / "first/trueline-measure"),
                                     ::testing::Pair("paint", root_ / "second/trueline-paint"),
                                     ::testing::Pair("repeat", root_ / "first/trueline-repeat")));
}

TEST_F(Verbs, AreSuggestedWhenMisspelt) {
  const auto verbs = FindVerbs({root_ / "first", root_ / "second"});
  EXPECT_EQ(ClosestVerb("mesure", verbs), "measure");
  EXPECT_EQ(ClosestVerb("repaet", verbs), "repeat");
  EXPECT_EQ(ClosestVerb("calibration", verbs), "");
}

TEST_F(Verbs, SayInOneLineWhatTheyDo) {
  EXPECT_EQ(OneLineHelp(root_ / "first/trueline-measure"), "Measures it");
  EXPECT_EQ(OneLineHelp(root_ / "absent"), "");
}

TEST_F(Verbs, AreListedByTheDispatcher) {
  const RunResult result = RunTrueline("--help");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.output, HasSubstr("measure      Measures it\n"));
}

TEST_F(Verbs, GetTheirArgumentsAndGiveTheirExitCode) {
  const RunResult result = RunTrueline("repeat --log='a b' --quiet");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.output, "[--log=a b][--quiet]");
}

TEST_F(Verbs, ThatAreUnknownExitWithTwoAndASuggestion) {
  const RunResult result = RunTrueline("mesure");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.output, HasSubstr("did you mean `trueline measure`?"));
  EXPECT_EQ(RunTrueline("").exit_code, 2);
}

}  // namespace
}  // namespace trueline
