// A result folder changes as one: all files of a run or none, and the user's files stay.
#include "problems/common/result_folder.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <set>

#include "problems/common/atomic_file.h"
#include "problems/common/verbs.h"
#include "tests/common/run_program.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

std::set<std::string> NamesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename());
  return names;
}

class ResultFolders : public testing::Test {
 protected:
  void Run(const std::string& program, const std::vector<std::string>& names,
           const std::string& text) const {
    ResultFolder result(out_, program);
    for (const std::string& name : names) WriteFileAtomically(result.path() / name, text);
    result.Commit(true);
  }

  TestFolder folder_;
  const fs::path out_ = folder_ / "out";
};

TEST_F(ResultFolders, HoldsAllFilesOfTheRunOrNone) {
  {
    ResultFolder result(out_, "trueline-a");
    WriteFileAtomically(result.path() / "one.csv", "1");
    EXPECT_FALSE(fs::exists(out_));
  }
  EXPECT_THAT(NamesIn(folder_.directory()), IsEmpty());
  Run("trueline-a", {"one.csv", "two.csv"}, "1");
  EXPECT_THAT(NamesIn(out_), ElementsAre("manifest.yaml", "one.csv", "two.csv"));
  EXPECT_THAT(NamesIn(folder_.directory()), ElementsAre("out"));
}

TEST_F(ResultFolders, ReplacesTheFilesOfTheRunBeforeAndNoOthers) {
  Run("trueline-a", {"one.csv", "two.csv"}, "old");
  fs::create_directories(out_ / "sub/deeper");
  WriteFileAtomically(out_ / "sub/deeper/note.txt", "mine");
  WriteFileAtomically(out_ / "note.txt", "mine");
  fs::create_symlink("nowhere", out_ / "link");
  Run("trueline-a", {"one.csv"}, "new");
  EXPECT_THAT(NamesIn(out_), ElementsAre("link", "manifest.yaml", "note.txt", "one.csv", "sub"));
  EXPECT_EQ(ReadText(out_ / "one.csv"), "new");
  EXPECT_EQ(ReadText(out_ / "note.txt"), "mine");
  EXPECT_EQ(ReadText(out_ / "sub/deeper/note.txt"), "mine");
  EXPECT_EQ(fs::read_symlink(out_ / "link"), "nowhere");
}

TEST_F(ResultFolders, AnInterruptedRunLeavesTheOldResultAndIsSweptUp) {
  Run("trueline-a", {"one.csv"}, "old");
  fs::create_directories(folder_ / ".out.part-1-0");  // as a killed run leaves it: nobody locks it
  WriteFileAtomically(folder_ / ".out.part-1-0/one.csv", "half");
  {
    ResultFolder running(out_, "trueline-a");
    ResultFolder other(out_, "trueline-a");  // does not sweep up the one that runs
    EXPECT_TRUE(fs::exists(running.path()));
    WriteFileAtomically(running.path() / "one.csv", "new");
  }
  EXPECT_EQ(ReadText(out_ / "one.csv"), "old");
  EXPECT_THAT(NamesIn(folder_.directory()), ElementsAre("out"));
}

TEST_F(ResultFolders, TheLaterOfTwoRunsLeavesAWholeResult) {
  ResultFolder first(out_, "trueline-a"), second(out_, "trueline-a");
  WriteFileAtomically(first.path() / "one.csv", "first");
  WriteFileAtomically(first.path() / "two.csv", "first");
  WriteFileAtomically(second.path() / "one.csv", "second");
  first.Commit(true);
  second.Commit(true);
  EXPECT_EQ(ReadText(out_ / "one.csv"), "second");
  EXPECT_THAT(ReadManifest(out_).files, ElementsAre("one.csv"));
  EXPECT_THAT(NamesIn(out_), ElementsAre("manifest.yaml", "one.csv"));
}

TEST_F(ResultFolders, TheWorkingFolderStaysTheSameFolder) {
  Run("trueline-a", {"one.csv", "two.csv"}, "old");
  const fs::path before = fs::current_path();
  fs::current_path(out_);
  {
    ResultFolder result(".", "trueline-b");
    WriteFileAtomically(result.path() / "one.csv", "new");
    result.Commit(true);
  }
  EXPECT_THAT(NamesIn("."), ElementsAre("manifest.yaml", "one.csv"));
  fs::current_path(before);
  EXPECT_THAT(NamesIn(folder_.directory()), ElementsAre("out"));
}

TEST_F(ResultFolders, RemovesNothingThatAForeignManifestNames) {
  WriteFileAtomically(folder_ / "precious.txt", "mine");
  WriteFileAtomically(out_ / "kept.txt", "mine");
  WriteFileAtomically(out_ / "manifest.yaml", "program: other\nsha256: {kept.txt: 0}\n");
  Run("trueline-a", {"one.csv"}, "new");
  EXPECT_TRUE(fs::exists(out_ / "kept.txt"));
  WriteFileAtomically(out_ / "manifest.yaml",
                      "program: trueline-a\nsha256: {../precious.txt: 0, .: 0, ..: 0}\n");
  Run("trueline-a", {"one.csv"}, "new");
  EXPECT_TRUE(fs::exists(folder_ / "precious.txt"));
}

TEST_F(ResultFolders, ALogLosesTheStreamsThatTheNewOneLacks) {
  for (const char* name : {"imu.csv", "pose.csv"}) WriteFileAtomically(out_ / name, "old");
  ResultFolder result(out_, std::vector<std::string>{"imu.csv", "pose.csv"});
  WriteFileAtomically(result.path() / "imu.csv", "new");
  result.Commit(true);
  EXPECT_THAT(NamesIn(out_), ElementsAre("imu.csv"));
}

TEST_F(ResultFolders, ALogReplacesNoFilesOfAnotherSource) {
  WriteFileAtomically(out_ / "imu.csv", "raw");
  const std::vector<std::string> owned = {"log.yaml", "imu.csv"};
  EXPECT_THAT(ErrorOf([&] { ResultFolder(out_, owned); }), HasSubstr("of no native log"));
  WriteFileAtomically(out_ / "log.yaml", "");
  ResultFolder(out_, owned).Commit(true);
}

TEST_F(ResultFolders, SaysWhatIsInTheWay) {
  WriteFileAtomically(folder_ / "file", "x");
  EXPECT_THAT(ErrorOf([&] { ResultFolder(folder_ / "file", "trueline-a"); }),
              HasSubstr("cannot be written (it is a file)"));
  EXPECT_THAT(ErrorOf([&] { ResultFolder(folder_ / "file/out", "trueline-a"); }),
              HasSubstr("check that the folder exists, is writable"));
  fs::create_directories(out_ / "one.csv");
  EXPECT_THAT(ErrorOf([&] { Run("trueline-a", {"one.csv"}, "new"); }),
              HasSubstr("one.csv: is a folder; a file of this name is to be written"));
}

TEST_F(ResultFolders, NamesTheFinalFolderInMessages) {
  const ResultFolder result(out_, "trueline-a");
  EXPECT_EQ(WithFinalNames((result.path() / "imu.csv").string() + ":3: NaN"),
            (out_ / "imu.csv").string() + ":3: NaN");
}

// Two folders with small programs as verbs.
class Verbs : public ::testing::Test {
 protected:
  Verbs() {
    AddProgram("first", "trueline-measure", "echo 'trueline-measure: Measures it. With care.'");
    AddProgram("first", "trueline-repeat", "printf '[%s]' \"$@\"; exit 3");
    AddProgram("second", "trueline-measure", "echo hidden");
    AddProgram("second", "trueline-paint", "true");
    std::ofstream(root_ / "first/trueline-notes") << "not a program\n";
  }

  void AddProgram(const std::string& folder, const std::string& name, const std::string& script) {
    fs::create_directories(root_ / folder);
    const fs::path path = root_ / folder / name;
    std::ofstream(path) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(path, fs::perms::owner_all);
  }
  Outcome RunTrueline(const std::string& arguments) const {
    return RunShell("PATH='" + (root_ / "first").string() +
                    "':\"$PATH\" '" TRUELINE_TEST_APPS_DIR "/trueline' " + arguments);
  }

  const TestFolder root_;
};

TEST_F(Verbs, AreExecutablesByNameAndTheFirstFolderWins) {
  const auto verbs = FindVerbs({root_ / "first", root_ / "absent", root_ / "second"});
  EXPECT_THAT(verbs, ElementsAre(::testing::Pair("measure", root_ / "first/trueline-measure"),
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
  const Outcome result = RunTrueline("--help");
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("measure      Measures it\n"));
}

TEST_F(Verbs, GetTheirArgumentsAndGiveTheirExitCode) {
  const Outcome result = RunTrueline("repeat --log='a b' --quiet");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.out + result.err, "[--log=a b][--quiet]");
}

TEST_F(Verbs, ThatAreUnknownExitWithTwoAndASuggestion) {
  EXPECT_THAT(RunTrueline("mesure"), Refuses("did you mean `trueline measure`?"));
  EXPECT_EQ(RunTrueline("").exit_code, 2);
}

}  // namespace
}  // namespace trueline
