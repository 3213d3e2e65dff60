// Bad input: an error with file, line and remedy (exit 2; all kinds: tests/log/bad_input_test.cc),
// or a warning and a defined treatment. Hovering and single passes get a verdict.
#include "tests/apps/calibrate_app.h"
#include "tests/common/matchers.h"

namespace trueline {
namespace {

#if defined(__SANITIZE_ADDRESS__)  // as g++ says it
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

class BadFlight : public CalibrateApp {
 protected:
  void ExpectRefused(const std::vector<std::string>& words) const {
    const Outcome done = Calibrate();
    EXPECT_EQ(done.exit_code, 2);
    for (const std::string& word : words) EXPECT_THAT(done.err, HasSubstr(word));
    EXPECT_THAT(done.out, IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(root_ / "out/calibration.yaml"));
  }
  YAML::Node Result() const { return YAML::LoadFile(root_ / "out/calibration.yaml"); }
};

TEST_F(BadFlight, MissingTimeStamp) {
  auto lines = Lines("imu.csv");
  lines[5] = lines[5].substr(lines[5].find(','));
  WriteLines("imu.csv", lines);
  ExpectRefused({"imu.csv:6: column 't': the time stamp is missing", "every row needs one"});
}

// A hole of 1 TB behind the rows takes no room on the disk.
TEST_F(BadFlight, ALogThatDoesNotFitInMemory) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer ends a program that asks for too much memory";
  std::filesystem::resize_file(root_ / "log/imu.csv", std::uintmax_t{1} << 40);
  ExpectRefused({(root_ / "log").string() + ": memory is used up", "cut the log"});
}

TEST_F(BadFlight, FlagsOfTheOtherDrive) {
  for (const char* flag :
       {"--estimator=nonsense", "--gamma=-5", "--thrust=foo", "--gamma_sweep=a,b"}) {
    EXPECT_THAT(Run(fmt::format("--drive=rotors --log='{}' --out='{}' {}", (root_ / "log").string(),
                                (root_ / "out").string(), flag)),
                Refuses(std::string(flag) + ": is for --drive=imu"));
  }
}

TEST_F(BadFlight, NoSuchLog) {
  std::filesystem::remove_all(root_ / "log");
  ExpectRefused({"log", "does not exist"});
}

TEST_F(BadFlight, MocapTooShortWithoutFixes) {
  std::filesystem::remove(root_ / "log/fixes.csv");
  auto lines = Lines("mocap.csv");
  lines.resize(4);
  WriteLines("mocap.csv", lines);
  ExpectRefused({"fixes.csv: there are no fixes to fit to", "trueline convert"});
}

TEST_F(BadFlight, FixesOfAnotherClock) {
  FlightLog log = Flight();
  for (Fix& fix : log.fixes) fix.t += 1000 * kNsPerSecond;
  WriteNativeLog(log, root_ / "log");
  ExpectRefused({"fixes.csv: no fix lies inside of the", "bring the clocks together"});
}

TEST_F(BadFlight, CutOffLastLineIsDroppedWithAWarning) {
  const std::string text = ReadText(root_ / "log/imu.csv");
  std::ofstream(root_ / "log/imu.csv") << text.substr(0, text.size() - 20);
  EXPECT_THAT(Calibrate(), Ends(0, HasSubstr("the last line is cut off; it is dropped")));
  EXPECT_THAT(Result()["warnings"][0].as<std::string>(), HasSubstr("cut off"));
}

TEST_F(BadFlight, GapInTheImuEndsWindowsWithAWarning) {
  FlightLog log = Flight();
  const std::vector<Pass> passes = FindPasses(log.fixes, PassOptions());
  ASSERT_GE(passes.size(), 3U);
  const TimeNs from = passes[1].end + kNsPerSecond / 10, to = from + kNsPerSecond * 6 / 10;
  std::erase_if(log.imu, [&](const ImuSample& s) { return s.t > from && s.t < to; });
  WriteNativeLog(log, root_ / "log");
  EXPECT_THAT(Calibrate(),
              Ends(0, AllOf(HasSubstr("imu: 1 gaps longer than"), HasSubstr("the arc after pass 2"),
                            HasSubstr("is not predicted"))));
  EXPECT_EQ(Result()["arcs"]["count"].as<std::size_t>(), passes.size() - 2);
}

TEST_F(BadFlight, OneSinglePassIsPoorAndSaysWhy) {
  FlightLog log = Flight();
  const Pass whole = FindPasses(log.fixes, PassOptions()).at(1);  // the first is cut by the start
  log.fixes = std::vector<Fix>(log.fixes.begin() + whole.first, log.fixes.begin() + whole.last + 1);
  WriteNativeLog(log, root_ / "log");
  const Outcome done = Calibrate();
  EXPECT_EQ(done.exit_code, 0) << done.out;
  EXPECT_EQ(Result()["verdict"].as<std::string>(), "poor");
  EXPECT_THAT(Result()["reasons"].as<std::vector<std::string>>(),
              Contains(HasSubstr("single pass")));
  EXPECT_THAT(done.out, AllOf(HasSubstr("verdict: poor"), HasSubstr("single pass")));
}

// Fixes that come singly, and a detector that reports all the time: both are hovers.
TEST_F(BadFlight, HoveringIsUnusable) {
  for (const int fixes : {18, 400}) {
    SCOPED_TRACE(fixes);
    SimulationConfig config = testing_simulation::ReadShipped("hover");
    config.detector.fixes_min = config.detector.fixes_max = fixes;
    WriteNativeLog(testing_simulation::Fly(config, 1).log, root_ / "log");
    const Outcome done = Calibrate();
    EXPECT_EQ(done.exit_code, 3) << done.err;
    EXPECT_EQ(Result()["verdict"].as<std::string>(), "unusable");
    EXPECT_THAT(done.out, AllOf(HasSubstr("verdict: unusable"), HasSubstr("hovering")));
  }
}

// An accelerometer that does not measure gives drag a value, and a small sigma.
TEST_F(BadFlight, AFaultOfTheLogIsAReasonOfTheVerdict) {
  FlightLog log = Flight();
  for (ImuSample& sample : log.imu) sample.accel.x() = 0.0;
  WriteNativeLog(log, root_ / "log");
  EXPECT_EQ(Calibrate().exit_code, 0);
  EXPECT_EQ(Result()["verdict"].as<std::string>(), "poor");
  EXPECT_THAT(Result()["reasons"].as<std::vector<std::string>>(),
              Contains(AllOf(HasSubstr("dead_axis"), HasSubstr("ax"))));
}

TEST_F(BadFlight, OneRecordingTwiceIsRefused) {
  WriteNativeLog(Flight(), root_ / "copy");
  EXPECT_THAT(Run(fmt::format("--log='{0}/log','{0}/copy' --estimator=smoother --out='{0}/out'",
                              root_.string())),
              Ends(2, AllOf(HasSubstr("copy: is the same recording as"), HasSubstr("once"))));
}

}  // namespace
}  // namespace trueline
