// trueline-convert as a user runs it: exit codes, table, silence.
#include <sstream>

#include "tests/common/run_program.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

class ConvertApp : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(App("convert"))) GTEST_SKIP() << "it is not built";
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

  static Outcome Run(const std::string& arguments) { return RunApp("convert", arguments); }
  std::string Usual() const {
    return fmt::format("--map='{}' --in='{}' --out='{}'", map_, csv_, out_);
  }

  ImportFiles files_;
  std::string map_, csv_, out_;
};

TEST_F(ConvertApp, AFilesNameMayHaveACommaInIt) {
  const std::string file = files_.Write("lap 1,2.csv", ReadText(csv_));
  const Outcome done = Run(fmt::format("--map='{}' --in='{}' --out='{}'", map_, file, out_));
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(ConvertApp, WritesALogAndPrintsItsStreams) {
  const Outcome done = Run(Usual());
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("imu             400      100.00"), HasSubstr("fixes"),
                              HasSubstr("1 gates")));
  EXPECT_TRUE(std::filesystem::exists(out_ + "/log.yaml"));
}

TEST_F(ConvertApp, ReadsCsvThatIsCompressed) {
  const std::string text = ReadText(csv_);
  csv_ = (files_ / "log.csv.gz").string();
  WriteCompressed(csv_, text);
  EXPECT_EQ(Run(Usual()).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(out_ + "/log.yaml"));
  std::filesystem::resize_file(csv_, std::filesystem::file_size(csv_) / 2);
  EXPECT_THAT(Run(Usual()), Refuses("log.csv.gz: is damaged or cut off (gzip)"));
}

// The columns of IMU and trajectory, for which a map ships, read by another map.
TEST_F(ConvertApp, SaysWhichMapFits) {
  std::string text =
      "t,x,y,z,qx,qy,qz,qw,wx,wy,wz,x_poses,y_poses,z_poses,m1_erpm,m2_erpm,m3_erpm,m4_erpm,ax,ay,"
      "az,Vbat\n";
  for (int i = 0; i < 100; ++i) {
    text += fmt::format("{},0,0,1,0,0,0,1,0,0,0,0,0,1,1,1,1,1,0,0,9.81,4\n", 0.01 * i);
  }
  csv_ = files_.Write("square.csv", text);
  map_ = std::string(TRUELINE_TEST_SOURCE_DIR) + "/config/import/idsia_nanodrone.yaml";
  EXPECT_THAT(Run(Usual()), Ends(2, AllOf(HasSubstr("there is no column 'x_mocap'"),
                                          HasSubstr("its columns are those of "),
                                          HasSubstr("config/import/idsia_nanodrone_square.yaml"))));
}

TEST_F(ConvertApp, KeepsTheMapThatAUserEdited) {
  std::filesystem::create_directories(out_);
  std::filesystem::rename(map_, out_ + "/proposed_map.yaml");
  map_ = out_ + "/proposed_map.yaml";
  const std::string edited = ReadText(map_);
  EXPECT_EQ(Run(Usual()).exit_code, 0);
  EXPECT_EQ(ReadText(map_), edited);
}

TEST_F(ConvertApp, RefusesAnInputInItsOwnFolder) {
  const std::string in = std::filesystem::path(csv_).parent_path();
  EXPECT_THAT(Run(fmt::format("--map='{}' --in='{}' --out='{}'", map_, csv_, in)),
              Refuses("lies in --out"));
  EXPECT_TRUE(std::filesystem::exists(csv_));
}

TEST_F(ConvertApp, RefusesNamesThatFitNoColumns) {
  files_.Write("log.csv", "t,a,x\n1,0.0,0,1\n2,0.1,0,2\n");
  EXPECT_THAT(Run(Usual()), Refuses("names 3 columns where the rows have 4"));
}

TEST_F(ConvertApp, IsQuietWhereAsked) {
  const Outcome done = Run(Usual() + " --quiet");
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.out + done.err, IsEmpty());
}

TEST_F(ConvertApp, RepeatsWithTheSeed) {
  const auto fixes = [&](int seed) {
    Run(fmt::format("{} --seed={}", Usual(), seed));
    return ReadText(out_ + "/fixes.csv");
  };
  const std::string first = fixes(1);
  EXPECT_EQ(first, fixes(1));
  EXPECT_NE(first, fixes(2));
}

TEST_F(ConvertApp, TakesSettingsOfFixesFromFlags) {
  Run(Usual() +
      " --straights='1<x<3' --sigma_factor=0 --sigma_floor=0.01 --min_count=7 "
      "--max_count=7");
  std::istringstream fixes(ReadText(out_ + "/fixes.csv"));
  int lines = 0;
  for (std::string line; std::getline(fixes, line); ++lines) {
    EXPECT_THAT(line, testing::EndsWith(lines == 0 ? "gate [1]" : ",0.01,0"));
  }
  EXPECT_EQ(lines, 8);
}

TEST_F(ConvertApp, RefusesBadInput) {
  EXPECT_THAT(Run(""), Refuses("--map, --in and --out are needed"));
  files_.Write("log.csv", "t,a,x\n1,0,0\n0,0,0\n");
  EXPECT_THAT(Run(Usual()), Refuses("log.csv:3: column 't'"));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(ConvertApp, SaysThatALogIsNative) {
  ASSERT_EQ(Run(Usual()).exit_code, 0);
  for (const std::string& map : {std::string(), fmt::format("--map='{}'", map_)}) {
    EXPECT_THAT(Run(fmt::format("{} --in='{}' --out='{}2'", map, out_, out_)),
                Refuses("is a native log already"));
  }
}

TEST_F(ConvertApp, ListsALogAndProposesAMap) {
  const Outcome listed = Run(fmt::format("--in='{}'", csv_));
  EXPECT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, AllOf(HasSubstr("log.csv: CSV"), HasSubstr("t a x"),
                                HasSubstr("# imu: none was found by the names; it is needed")));
  EXPECT_FALSE(std::filesystem::exists(out_));
}

TEST_F(ConvertApp, RefusesABinaryLogForAMapOfCsv) {
  files_.Write("log.csv", std::string("ULog\x01\x12\x35\x01", 8) + std::string(8, '\0'));
  EXPECT_THAT(Run(Usual()), Refuses("is of format ulog, where"));
}

TEST_F(ConvertApp, SaysThatNoMapFits) {
  EXPECT_THAT(Run(fmt::format("--in='{}' --out='{}'", csv_, out_)),
              Ends(3, HasSubstr("has no accelerometer and gyroscope by the names of its fields")));
  EXPECT_THAT(ReadText(out_ + "/proposed_map.yaml"),
              HasSubstr("inputs:\n  log: {delimiter: \",\""));
  EXPECT_FALSE(std::filesystem::exists(out_ + "/log.yaml"));
}

// A folder with the columns of EuRoC, whose map ships.
TEST_F(ConvertApp, ConvertsAKnownFormatWithoutAMap) {
  const std::string log = (files_ / "flight").string();
  std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  std::string truth =
      "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";
  for (int i = 0; i < 100; ++i) {
    imu += fmt::format("{},0,0,0,9.81,0,0\n", 1'000'000'000 + i * 10'000'000);
    truth += fmt::format("{},1,2,3,1,0,0,0\n", 1'000'000'000 + i * 10'000'000);
  }
  for (const char* sensor : {"imu0", "state_groundtruth_estimate0"}) {
    std::filesystem::create_directories(log + "/mav0/" + sensor);
  }
  files_.Write("flight/mav0/imu0/data.csv", imu);
  files_.Write("flight/mav0/state_groundtruth_estimate0/data.csv", truth);
  const Outcome done = Run(fmt::format("--in='{}' --out='{}'", log, out_));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, AllOf(HasSubstr("imu             100      100.00"), HasSubstr("mocap")));
  EXPECT_THAT(ReadText(out_ + "/proposed_map.yaml"), HasSubstr("# EuRoC MAV"));
  EXPECT_THAT(ReadText(out_ + "/imu.csv"), HasSubstr("-9.81"));
  std::filesystem::remove_all(log + "/mav0/state_groundtruth_estimate0");
  const Outcome lacks = Run(fmt::format("--in='{}' --out='{}2'", log, out_));
  EXPECT_EQ(lacks.exit_code, 3);
  EXPECT_THAT(lacks.err, HasSubstr("no usable log: "));
  EXPECT_THAT(lacks.err, HasSubstr("has no position"));
}

TEST_F(ConvertApp, TeachesByExample) {
  EXPECT_THAT(Run("--helpshort").out,
              AllOf(HasSubstr("trueline convert --map=config/import/nanobench.yaml"),
                    HasSubstr("--straights='-0.9<x<0.9'"), HasSubstr("sigma_factor")));
}

}  // namespace
}  // namespace trueline
