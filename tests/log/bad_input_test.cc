// All kinds of bad native logs: each gives an error that names file, line, finding and remedy, or a
// warning and a defined treatment.
#include <fmt/format.h>

#include "tests/log/log_files.h"

namespace trueline {
namespace {

const char kMocap[] =
    "t [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]\n"
    "1.0,0,0,-1,1,0,0,0\n1.1,0,0,-1,1,0,0,0\n";

TEST(BadInput, AGoodLogHasNone) {
  const FlightLog log = LogFiles().Read();
  EXPECT_EQ(log.imu.size(), 3U);
  EXPECT_EQ(log.fixes.size(), 2U);
  EXPECT_THAT(log.warnings, IsEmpty());
}

// A text of a small log's file that is replaced by another. Without the first the whole file is,
// and without both it is removed.
struct Mistake {
  const char *file, *from, *to, *said, *remedy = "";
};
const Mistake kMistakes[] = {
    {"imu.csv", "t [s]", "time [s]", "imu.csv:1: column 't' is missing",
     "the header has: time, ax, ay"},
    {"imu.csv", "1.01,", ",",
     "imu.csv:3: column 't': the time stamp is missing; every row needs one"},
    {"imu.csv", "1.02,", "1.005,",
     "imu.csv:4: column 't': 1.005000000 s does not come after 1.010000000 s", "sort the rows"},
    {"fixes.csv", "1.015", "1.005", "fixes.csv:3: column 't'", "remove repeated stamps"},
    {"imu.csv", "-9.82", "nan", "imu.csv:3: column 'az': found 'nan'",
     "remove the row or repair it"},
    {"fixes.csv", "2,-1.5", "-inf,-1.5", "fixes.csv:2: column 'y': found '-inf'"},
    {"fixes.csv", "2,-1.5", "1e308,-1.5", "fixes.csv:2: column 'y': found '1e308'",
     "beyond anything that flies"},
    {"imu.csv", "0.2,0.3", "0.2,fast", "imu.csv:3: column 'ay': 'fast' is no number",
     "repair or remove the line"},
    {"imu.csv", "1.01,0.2,0.3,", "1.01,0.2,",
     "imu.csv:3: found 6 fields where the header has 7; repair or remove the line"},
    {"imu.csv", "ay [m/s^2]", "ay [furlong/s^2]",
     "imu.csv:1: column 'ay': unit 'furlong/s^2' is not known here",
     "use one of: m/s^2, g, mg, cm/s^2, mm/s^2"},
    {"imu.csv", "ax [m/s^2],ay [m/s^2]", "ax [g],ay",
     "imu.csv:1: column 'ay' states no unit, but 'ax' is in g", "write 'ay [unit]'"},
    {"imu.csv", "ay [m/s^2]", "ax [m/s^2]", "imu.csv:1: column 'ax' occurs twice; keep one"},
    {"log.yaml", "gravity: 9.81", "gravity: 9.81\ngavity: 9.8", "log.yaml:5: 'gavity': unknown key",
     "known here:"},
    // Beside all that are known.
    {"log.yaml", "gravity: 9.81", "gravity: 9.81\nvehicel: {mass: 1}", "'vehicel': unknown key",
     "vehicle"},
    {"log.yaml", "gravity: 9.81", "gravity: 9.81\nvehicel: {mass: 1}", "environment"},
    {"log.yaml", "gravity: 9.81", "gravity: 9.81\nenvironment: inside", "log.yaml:5",
     "'inside' is not known"},
    {"log.yaml", "gravity: 9.81", "gravity: 9.81\nenvironment: inside", "indoors, outdoors"},
    {"log.yaml", "", nullptr, "log.yaml", "no such file"},
    {"log.yaml", "NED", "ENU", "log.yaml:2: 'frame': found 'ENU'",
     "trueline convert turns other frames"},
    {"log.yaml", "FRD", "FLU", "log.yaml:3: 'body': found 'FLU'"},
    {"log.yaml", "gravity: 9.81",
     "gates:\n  - {id: 4, position: [0, 0, 0]}\n  - {id: 4, position: [1, 0, 0]}",
     "log.yaml:6: 'gates[1].id': gate 4 occurs twice", "an id of its own"},
    {"log.yaml", "gravity: 9.81",
     "vehicle:\n  rotors:\n    - {position: [0, 0, 0], axis: [0, 0, -1], spin: 2, k_f: 1, k_m: 1}",
     "log.yaml:6: 'vehicle.rotors[0].spin': found 2; use 1"},
    {"imu.csv", "", nullptr, "imu.csv: is missing; every log needs 't [s],ax"},
    {"imu.csv", "", "", "imu.csv: the file is empty; write a header line"},
    {"fixes.csv", "", "t [s],x [m],y [m],z [m],sigma [m],gate [1]\n",
     "fixes.csv: has a header but no rows", "remove the file"},
    {"fixes.csv", "", nullptr, "has neither fixes.csv nor mocap.csv, nor pose.csv",
     "add position fixes"},
    {"fixes.csv", "0.1,0", "0,0",
     "fixes.csv:2: column 'sigma': found 0; a standard deviation must be positive"},
    {"fixes.csv", "0.1,0", "0.1,0.5", "fixes.csv:2: column 'gate': found 0.5"},
    // Below 0 stands "no gate".
    {"fixes.csv", "0.1,0", "0.1,-7", "fixes.csv:2: column 'gate': found -7; an id is a whole"},
    {"log.yaml", "gravity: 9.81", "gates:\n  - {id: -7, position: [0, 0, 0]}",
     "log.yaml:5: 'gates[0].id': must be 0 or more"},
    {"mocap.csv", "", "t [s],x,y,z,qw,qx,qy,qz\n1.0,0,0,-1,0.7,0,0,0\n1.1,0,0,-1,1,0,0,0\n",
     "mocap.csv:2: column 'qw': the quaternion's norm is 0.7", "check the order of the columns"},
    {"rotors.csv", "", "t [s],w2 [rad/s]\n1.0,900\n", "rotors.csv:1: column 'w1' is missing"},
};

TEST(BadInput, IsNamedWithPlaceAndRemedy) {
  for (const Mistake& mistake : kMistakes) {
    const LogFiles log;
    if (*mistake.from != '\0') {
      ReplaceIn(log / mistake.file, mistake.from, mistake.to);
    } else if (mistake.to != nullptr) {
      WriteText(log / mistake.file, mistake.to);
    } else {
      std::filesystem::remove(log / mistake.file);
    }
    EXPECT_THAT(log.Error(), AllOf(HasSubstr(mistake.said), HasSubstr(mistake.remedy)));
  }
}

TEST(BadInput, NoDirectory) {
  EXPECT_THAT(ErrorOf([] { ReadNativeLog("/nowhere/at/all"); }),
              AllOf(HasSubstr("/nowhere/at/all"), HasSubstr("does not exist")));
}

// As a log.yaml that was cut within the number.
TEST(BadInput, GravityOfNoPlaceOnTheEarth) {
  const LogFiles log;
  EXPECT_THAT(log.Read().warnings, IsEmpty());
  ReplaceIn(log / "log.yaml", "gravity: 9.81", "gravity: 9");
  EXPECT_THAT(log.Read().warnings, ElementsAre(HasSubstr("log.yaml: gravity is 9 m/s^2")));
}

// A section that is left empty says nothing, as does an environment.
TEST(BadInput, WhatIsLeftOutIsNone) {
  const LogFiles empty;
  EXPECT_EQ(empty.Read().environment, "");
  ReplaceIn(empty / "log.yaml", "gravity: 9.81", "gravity: 9.81\nvehicle:");
  EXPECT_EQ(empty.Error(), "no error");
}

// The reader accepts it; fixes are sampled later, or the fit is to mocap itself.
TEST(BadInput, MocapWithoutFixesIsLegal) {
  const LogFiles log;
  std::filesystem::remove(log / "fixes.csv");
  WriteText(log / "mocap.csv", kMocap);
  const FlightLog read = log.Read();
  EXPECT_TRUE(read.fixes.empty());
  EXPECT_EQ(read.mocap.size(), 2U);
}

TEST(BadInput, ALastLineThatIsCutOffIsDropped) {
  const std::string imu = ReadText(LogFiles() / "imu.csv");
  struct Cut {
    const char* file;
    std::string text;
    std::size_t imu, mocap;  // rows that are left
  };
  for (const auto& [file, text, imu_rows, mocap_rows] :
       std::vector<Cut>{{"imu.csv", imu.substr(0, imu.size() - 12), 2, 0},
                        {"mocap.csv", std::string(kMocap) + "1.2,0,0,-1,1,0,0,-", 3, 2},
                        // 0.0 of 0.70711: still a number, but no longer a quaternion.
                        {"mocap.csv", std::string(kMocap) + "1.2,0,0,-1,0.70711,0,0,0.", 3, 2}}) {
    const LogFiles log;
    WriteText(log / file, text);
    const FlightLog read = log.Read();
    EXPECT_EQ(read.imu.size(), imu_rows);
    EXPECT_EQ(read.mocap.size(), mocap_rows);
    EXPECT_THAT(
        read.warnings,
        ElementsAre(HasSubstr(fmt::format("{}:4: the last line is cut off; it is dropped", file))));
  }
}

TEST(BadInput, ALastLineWithoutNewlineIsKept) {
  const LogFiles log;
  std::string text = ReadText(log / "imu.csv");
  text.pop_back();
  WriteText(log / "imu.csv", text);
  EXPECT_EQ(log.Read().imu.size(), 3U);
}

TEST(BadInput, QuaternionOfFewDigitsIsNormalised) {
  const LogFiles log;
  WriteText(log / "attitude.csv", "t [s],qw,qx,qy,qz\n1.0,0.707,0,0,0.707\n1.1,1,0,0,0\n");
  EXPECT_NEAR(log.Read().attitude[0].q_Ep_I.norm(), 1.0, 1e-15);
}

// A column that is stuck for a while bends the quaternions, which are normalised: a norm says so.
TEST(BadInput, SomeQuaternionsOfAStrangeNorm) {
  const LogFiles log;
  std::string rows = "t [s],qw,qx,qy,qz\n";
  for (int i = 0; i < 50; ++i) rows += fmt::format("{},{},0,0,0.6\n", 1.0 + 0.1 * i, 0.8);
  WriteText(log / "attitude.csv", rows);
  EXPECT_THAT(log.Read().warnings, Not(Contains(HasSubstr("quaternions"))));
  WriteText(log / "attitude.csv", rows + "6.1,0.803,0,0,0.6\n");
  EXPECT_THAT(log.Read().warnings,
              Contains(HasSubstr("attitude.csv: 1 of 51 quaternions have a norm that differs")));
}

TEST(BadInput, UnknownColumnsAreIgnoredOnce) {
  const LogFiles log;
  WriteText(log / "range.csv", "quality [1],t [s],range [m],spare\n9,1.0,1.5,x\n9,1.1,1.6,y\n");
  const FlightLog read = log.Read();
  ASSERT_EQ(read.range.size(), 2U);
  EXPECT_EQ(read.range[1].value, 1.6);
  EXPECT_THAT(read.warnings, ElementsAre(AllOf(HasSubstr("range.csv: columns quality, spare"),
                                               HasSubstr("ignored"))));
}

}  // namespace
}  // namespace trueline
