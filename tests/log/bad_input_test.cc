// All kinds of bad native logs: each gives an error that names file, line, finding and remedy, or a
// warning and a defined treatment.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/log/log_files.h"

namespace trueline {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const char kMocap[] =
    "t [s],x [m],y [m],z [m],qw [1],qx [1],qy [1],qz [1]\n"
    "1.0,0,0,-1,1,0,0,0\n1.1,0,0,-1,1,0,0,0\n";

TEST(BadInput, AGoodLogHasNone) {
  const FlightLog log = LogFiles().Read();
  EXPECT_EQ(log.imu.size(), 3U);
  EXPECT_EQ(log.fixes.size(), 2U);
  EXPECT_THAT(log.warnings, IsEmpty());
}

TEST(BadInput, NoDirectory) {
  EXPECT_THAT(ErrorOf([] { ReadNativeLog("/nowhere/at/all"); }),
              AllOf(HasSubstr("/nowhere/at/all"), HasSubstr("does not exist")));
}

TEST(BadInput, MissingTimeColumn) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "t [s]", "time [s]");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("imu.csv:1: column 't' is missing"),
                                 HasSubstr("the header has: time, ax, ay")));
}

TEST(BadInput, MissingTimeStamp) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "1.01,", ",");
  EXPECT_THAT(log.Error(), HasSubstr("imu.csv:3: column 't': the time stamp is missing; every row "
                                     "needs one"));
}

TEST(BadInput, UnsortedTimeStamps) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "1.02,", "1.005,");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("imu.csv:4: column 't': 1.005000000 s does not come "
                                           "after 1.010000000 s"),
                                 HasSubstr("sort the rows")));
}

TEST(BadInput, RepeatedTimeStamps) {
  const LogFiles log;
  ReplaceIn(log / "fixes.csv", "1.015", "1.005");
  EXPECT_THAT(log.Error(),
              AllOf(HasSubstr("fixes.csv:3: column 't'"), HasSubstr("remove repeated stamps")));
}

TEST(BadInput, NotANumber) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "-9.82", "nan");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("imu.csv:3: column 'az': found 'nan'"),
                                 HasSubstr("remove the row or repair it")));
}

TEST(BadInput, Infinity) {
  const LogFiles log;
  ReplaceIn(log / "fixes.csv", "2,-1.5", "-inf,-1.5");
  EXPECT_THAT(log.Error(), HasSubstr("fixes.csv:2: column 'y': found '-inf'"));
}

TEST(BadInput, ANumberThatOverflowsInAFit) {
  const LogFiles log;
  ReplaceIn(log / "fixes.csv", "2,-1.5", "1e308,-1.5");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("fixes.csv:2: column 'y': found '1e308'"),
                                 HasSubstr("beyond anything that flies")));
}

TEST(BadInput, TextInPlaceOfANumber) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "0.2,0.3", "0.2,fast");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("imu.csv:3: column 'ay': 'fast' is no number"),
                                 HasSubstr("repair or remove the line")));
}

TEST(BadInput, MalformedLineInTheMiddle) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "1.01,0.2,0.3,", "1.01,0.2,");
  EXPECT_THAT(log.Error(), HasSubstr("imu.csv:3: found 6 fields where the header has 7; repair or "
                                     "remove the line"));
}

TEST(BadInput, UnknownUnit) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "ay [m/s^2]", "ay [furlong/s^2]");
  EXPECT_THAT(log.Error(),
              AllOf(HasSubstr("imu.csv:1: column 'ay': unit 'furlong/s^2' is not known here"),
                    HasSubstr("use one of: m/s^2, g, mg, cm/s^2, mm/s^2")));
}

TEST(BadInput, AUnitLeftOutBesideAnother) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "ax [m/s^2],ay [m/s^2]", "ax [g],ay");
  EXPECT_THAT(log.Error(),
              AllOf(HasSubstr("imu.csv:1: column 'ay' states no unit, but 'ax' is in g"),
                    HasSubstr("write 'ay [unit]'")));
}

TEST(BadInput, ColumnTwice) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "ay [m/s^2]", "ax [m/s^2]");
  EXPECT_THAT(log.Error(), HasSubstr("imu.csv:1: column 'ax' occurs twice; keep one"));
}

TEST(BadInput, UnknownYamlKey) {
  const LogFiles log;
  ReplaceIn(log / "log.yaml", "gravity: 9.81", "gravity: 9.81\ngavity: 9.8");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("log.yaml:5: 'gavity': unknown key"),
                                 HasSubstr("known here:"), HasSubstr("gravity")));
}

// As a log.yaml that was cut within the number.
TEST(BadInput, GravityOfNoPlaceOnTheEarth) {
  const LogFiles log;
  EXPECT_THAT(log.Read().warnings, IsEmpty());
  ReplaceIn(log / "log.yaml", "gravity: 9.81", "gravity: 9");
  EXPECT_THAT(log.Read().warnings, ElementsAre(HasSubstr("log.yaml: gravity is 9 m/s^2")));
}

TEST(BadInput, UnknownEnvironment) {
  const LogFiles log;
  EXPECT_EQ(log.Read().environment, "");
  ReplaceIn(log / "log.yaml", "gravity: 9.81", "gravity: 9.81\nenvironment: inside");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("log.yaml:5"), HasSubstr("'inside' is not known"),
                                 HasSubstr("indoors, outdoors")));
}

TEST(BadInput, NoLogYaml) {
  const LogFiles log;
  std::filesystem::remove(log / "log.yaml");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("log.yaml"), HasSubstr("no such file")));
}

TEST(BadInput, AnotherFrame) {
  const LogFiles log;
  ReplaceIn(log / "log.yaml", "NED", "ENU");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("log.yaml:2: 'frame': found 'ENU'"),
                                 HasSubstr("trueline convert turns other frames")));
}

TEST(BadInput, AnotherBodyFrame) {
  const LogFiles log;
  ReplaceIn(log / "log.yaml", "FRD", "FLU");
  EXPECT_THAT(log.Error(), HasSubstr("log.yaml:3: 'body': found 'FLU'"));
}

// A section that is left empty says nothing.
TEST(BadInput, AnUnknownKeyIsRefusedBesideAllThatAreKnown) {
  const LogFiles empty, unknown;
  ReplaceIn(empty / "log.yaml", "gravity: 9.81", "gravity: 9.81\nvehicle:");
  EXPECT_EQ(empty.Error(), "no error");
  ReplaceIn(unknown / "log.yaml", "gravity: 9.81", "gravity: 9.81\nvehicel: {mass: 1}");
  EXPECT_THAT(unknown.Error(), AllOf(HasSubstr("'vehicel': unknown key"), HasSubstr("vehicle"),
                                     HasSubstr("environment")));
}

TEST(BadInput, GateIdTwice) {
  const LogFiles log;
  ReplaceIn(log / "log.yaml", "gravity: 9.81",
            "gates:\n  - {id: 4, position: [0, 0, 0]}\n  - {id: 4, position: [1, 0, 0]}");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("log.yaml:6: 'gates[1].id': gate 4 occurs twice"),
                                 HasSubstr("an id of its own")));
}

TEST(BadInput, ImpossibleVehicle) {
  const LogFiles log;
  ReplaceIn(log / "log.yaml", "gravity: 9.81",
            "vehicle:\n  rotors:\n    - {position: [0, 0, 0], axis: [0, 0, -1], spin: 2, k_f: 1, "
            "k_m: 1}");
  EXPECT_THAT(log.Error(), HasSubstr("log.yaml:6: 'vehicle.rotors[0].spin': found 2; use 1"));
}

TEST(BadInput, NoImu) {
  const LogFiles log;
  std::filesystem::remove(log / "imu.csv");
  EXPECT_THAT(log.Error(), HasSubstr("imu.csv: is missing; every log needs 't [s],ax"));
}

TEST(BadInput, EmptyStream) {
  const LogFiles log;
  WriteText(log / "imu.csv", "");
  EXPECT_THAT(log.Error(), HasSubstr("imu.csv: the file is empty; write a header line"));
}

TEST(BadInput, HeaderWithoutRows) {
  const LogFiles log;
  WriteText(log / "fixes.csv", "t [s],x [m],y [m],z [m],sigma [m],gate [1]\n");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("fixes.csv: has a header but no rows"),
                                 HasSubstr("remove the file")));
}

TEST(BadInput, NeitherFixesNorMocap) {
  const LogFiles log;
  std::filesystem::remove(log / "fixes.csv");
  EXPECT_THAT(log.Error(), AllOf(HasSubstr("has neither fixes.csv nor mocap.csv, nor pose.csv"),
                                 HasSubstr("add position fixes")));
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

TEST(BadInput, CutOffLastLine) {
  const LogFiles log;
  std::string text = ReadText(log / "imu.csv");
  WriteText(log / "imu.csv", text.substr(0, text.size() - 12));
  const FlightLog read = log.Read();
  EXPECT_EQ(read.imu.size(), 2U);
  EXPECT_THAT(read.warnings,
              ElementsAre(HasSubstr("imu.csv:4: the last line is cut off; it is dropped")));
}

TEST(BadInput, CutOffInsideANumber) {
  const LogFiles log;
  WriteText(log / "mocap.csv", std::string(kMocap) + "1.2,0,0,-1,1,0,0,-");
  const FlightLog read = log.Read();
  EXPECT_EQ(read.mocap.size(), 2U);
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("mocap.csv:4: the last line is cut off")));
}

// 0.0 of 0.70711: still a number, but no longer a quaternion.
TEST(BadInput, CutOffInsideAQuaternion) {
  const LogFiles log;
  WriteText(log / "mocap.csv", std::string(kMocap) + "1.2,0,0,-1,0.70711,0,0,0.");
  const FlightLog read = log.Read();
  EXPECT_EQ(read.mocap.size(), 2U);
  EXPECT_THAT(read.warnings, ElementsAre(HasSubstr("mocap.csv:4: the last line is cut off")));
}

TEST(BadInput, ALastLineWithoutNewlineIsKept) {
  const LogFiles log;
  std::string text = ReadText(log / "imu.csv");
  text.pop_back();
  WriteText(log / "imu.csv", text);
  EXPECT_EQ(log.Read().imu.size(), 3U);
}

TEST(BadInput, QuaternionThatIsNone) {
  const LogFiles log;
  WriteText(log / "mocap.csv", kMocap);
  ReplaceIn(log / "mocap.csv", "-1,1,0,0,0", "-1,0.7,0,0,0");
  EXPECT_THAT(log.Error(),
              AllOf(HasSubstr("mocap.csv:2: column 'qw': the quaternion's norm is 0.7"),
                    HasSubstr("check the order of the columns")));
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

TEST(BadInput, SigmaThatIsNotPositive) {
  const LogFiles log;
  ReplaceIn(log / "fixes.csv", "0.1,0", "0,0");
  EXPECT_THAT(log.Error(), HasSubstr("fixes.csv:2: column 'sigma': found 0; a standard deviation "
                                     "must be positive"));
}

TEST(BadInput, GateThatIsNoWholeNumber) {
  const LogFiles log;
  ReplaceIn(log / "fixes.csv", "0.1,0", "0.1,0.5");
  EXPECT_THAT(log.Error(), HasSubstr("fixes.csv:2: column 'gate': found 0.5"));
}

// Below 0 stands "no gate".
TEST(BadInput, GateBelowZero) {
  const LogFiles fix, gate;
  ReplaceIn(fix / "fixes.csv", "0.1,0", "0.1,-7");
  EXPECT_THAT(fix.Error(), HasSubstr("fixes.csv:2: column 'gate': found -7; an id is a whole"));
  ReplaceIn(gate / "log.yaml", "gravity: 9.81", "gates:\n  - {id: -7, position: [0, 0, 0]}");
  EXPECT_THAT(gate.Error(), HasSubstr("log.yaml:5: 'gates[0].id': must be 0 or more"));
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

TEST(BadInput, MissingRotorColumn) {
  const LogFiles log;
  WriteText(log / "rotors.csv", "t [s],w2 [rad/s]\n1.0,900\n");
  EXPECT_THAT(log.Error(), HasSubstr("rotors.csv:1: column 'w1' is missing"));
}

}  // namespace
}  // namespace trueline
