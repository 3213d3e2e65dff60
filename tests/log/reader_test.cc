// Accepted input, conversions, and large files.
#include <sys/resource.h>

#include <cmath>

#include "problems/log/csv_text.h"
#include "problems/log/native_log.h"
#include "problems/log/units.h"
#include "tests/log/log_files.h"

namespace trueline {
namespace {

TEST(Reader, TakesColumnsInAnyOrderAndConvertsUnits) {
  const LogFiles log;
  WriteText(log / "imu.csv",
            "gz [deg/s],gy [deg/s],gx [rpm],az [g],ay [mm/s^2],ax [cm/s^2],t [ms]\r\n"
            "180,90,60,-1,1000,100,1500.5\r\n180,90,60,-1,1000,100,1501.5\r\n");
  WriteText(log / "fixes.csv",
            "gate,sigma [cm],z [mm],y [cm],x [m],t [us]\n2,10,-1500,200,1,1500600\n");
  const FlightLog read = log.Read();
  ASSERT_EQ(read.imu.size(), 2U);
  EXPECT_EQ(read.imu[0].t, 1'500'500'000);
  EXPECT_TRUE(read.imu[0].accel.isApprox(Eigen::Vector3d(1.0, 1.0, -9.80665), 1e-12));
  EXPECT_TRUE(read.imu[0].gyro.isApprox(M_PI * Eigen::Vector3d(2.0, 0.5, 1.0), 1e-12));
  EXPECT_EQ(read.fixes[0].t, 1'500'600'000);
  EXPECT_TRUE(read.fixes[0].p_E.isApprox(Eigen::Vector3d(1.0, 2.0, -1.5), 1e-12));
  EXPECT_NEAR(read.fixes[0].sigma, 0.1, 1e-15);
  EXPECT_EQ(read.fixes[0].gate, 2);
}

TEST(Reader, TakesUnitsFromTheFormatsTable) {
  const LogFiles log;
  ReplaceIn(log / "imu.csv", "ax [m/s^2],ay [m/s^2],az [m/s^2],gx [rad/s],gy [rad/s],gz [rad/s]",
            "ax [m/s^2], ay, az, gx [rad/s], gy, gz");
  EXPECT_EQ(log.Read().imu[2].accel.y(), 0.4);
}

TEST(Reader, ReadsChannelsOfAnyNumber) {
  const LogFiles log;
  WriteText(log / "rotors.csv", "t [s],w1 [rpm],w3 [rpm],w2 [rpm]\n1.0,30,90,60\n");
  const FlightLog read = log.Read();
  ASSERT_EQ(read.rotors.size(), 1U);
  EXPECT_NEAR(read.rotors[0].values[2], 3.0 * M_PI, 1e-12);
}

TEST(Time, IsReadWithoutLoss) {
  const auto parse = [](const char* text, int exponent) {
    TimeNs time = -1;
    EXPECT_TRUE(ParseTime(text, exponent, &time)) << text;
    return time;
  };
  EXPECT_EQ(parse("1772660536.302306891", 9), 1'772'660'536'302'306'891);
  EXPECT_EQ(parse("1772660536302306891", 0), 1'772'660'536'302'306'891);
  EXPECT_EQ(parse("1772660536302306.891", 3), 1'772'660'536'302'306'891);
  EXPECT_EQ(parse("1772660536302.306891", 6), 1'772'660'536'302'306'891);
  EXPECT_EQ(parse("0.30000000000000004", 9), 300'000'000);
  EXPECT_EQ(parse("1.9999999999", 9), 2'000'000'000);
  EXPECT_EQ(parse("-0.5", 9), -500'000'000);
  EXPECT_EQ(parse("+1.5e-3", 9), 1'500'000);
  EXPECT_EQ(parse("1.7726605363023069e9", 9), 1'772'660'536'302'306'900);
  EXPECT_EQ(parse("1e-30", 9), 0);
}

TEST(Time, RefusesWhatIsNone) {
  TimeNs time = 0;
  for (const char* text : {"", "nan", "inf", "1.2.3", "12s", "-", ".", "1e", "1e400", "0x10"}) {
    EXPECT_FALSE(ParseTime(text, 9, &time)) << text;
  }
  EXPECT_FALSE(ParseTime("9999999999.9", 9, &time));  // beyond 292 years
}

TEST(Time, IsWrittenAsItIsRead) {
  for (const TimeNs time : {TimeNs{0}, TimeNs{-1}, TimeNs{1'772'660'536'302'306'891}}) {
    TimeNs back = 7;
    EXPECT_TRUE(ParseTime(TimeText(time), 9, &back));
    EXPECT_EQ(back, time);
  }
}

FlightLog LongLog(int samples) {
  FlightLog log;
  for (int i = 0; i < samples; ++i) {
    const double a = std::sin(0.01 * i);
    log.imu.push_back({i * 1'953'125LL, {a, 0.3 * a, -9.81 + 0.1 * a}, {a, 0.2 * a, -a}});
  }
  log.fixes.push_back({5, {1, 2, 3}, 0.1, 0});
  return log;
}

TEST(Imu, GapsAreReported) {
  FlightLog log = LongLog(2000);
  log.imu.erase(log.imu.begin() + 1024, log.imu.begin() + 1100);
  const FlightLog read = ReadBack(log);
  ASSERT_EQ(read.imu.size(), log.imu.size());
  EXPECT_THAT(read.warnings,
              ElementsAre(HasSubstr("imu: 1 gaps longer than 9.8 ms, 0.150 s in "
                                    "all, the longest 0.150 s, the first at 1.998")));
}

TEST(Imu, SaturationIsReported) {
  FlightLog log = LongLog(20000);
  for (int i = 5120; i < 5133; ++i) log.imu[static_cast<std::size_t>(i)].accel.z() = -39.2266;
  EXPECT_THAT(ReadBack(log).warnings,
              ElementsAre(HasSubstr("imu: az is saturated at -39.23 1 times, 0.023 s in all, first "
                                    "at 10.000 s")));
}

// In steps of 1 deg/s a slow turn stays at every value for many samples, at the greatest one as
// well.
TEST(Imu, ACoarseSlowSignalIsNotSaturation) {
  FlightLog log = LongLog(4000);
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    const double degrees = 30.0 * std::sin(2e-3 * static_cast<double>(i));
    log.imu[i].gyro.x() = std::round(degrees) * 0.0174532925;
  }
  EXPECT_THAT(ReadBack(log).warnings, IsEmpty());
}

TEST(Imu, AConstantChannelIsNotSaturation) {
  FlightLog log = LongLog(2000);
  for (ImuSample& sample : log.imu) sample.gyro.z() = 0.0;
  EXPECT_THAT(ReadBack(log).warnings, IsEmpty());
}

// Ten minutes at 512 Hz, written and read: below the limit for a log of 100 s.
TEST(Reader, StaysWithinMemory) {
  EXPECT_EQ(ReadBack(LongLog(512 * 600)).imu.size(), 512U * 600U);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
#if !defined(__SANITIZE_ADDRESS__)
  EXPECT_LT(usage.ru_maxrss, 200 * 1024);  // KiB
#endif
}

TEST(StreamTable, ListsRateAndSpan) {
  const std::string table = StreamTable(LongLog(1025));
  EXPECT_THAT(table, HasSubstr("imu            1025      512.00"));
  EXPECT_THAT(table, HasSubstr("fixes             1"));
  EXPECT_THAT(table, Not(HasSubstr("mocap")));
}

// --- Dates and times of day as text.

TimeNs DateOf(const char* text) {
  TimeNs time = -1;
  return ParseDateTime(text, &time) ? time : -1;
}

TEST(DateTime, IsCountedFrom1970) {
  EXPECT_EQ(DateOf("1970-01-02T00:00:01Z"), 86401 * kNsPerSecond);
  EXPECT_EQ(DateOf("2024-05-01T23:59:55.010000"), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("\"2024-05-01 23:59:55.01Z\""), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("2024-05-02T01:59:55,010000000+02:00"), 1'714'607'995'010'000'000);
  EXPECT_EQ(DateOf("2024-05-01T18:29:55.01-0530"), 1'714'607'995'010'000'000);
}

TEST(DateTime, OfADayIsCountedFromMidnight) {
  EXPECT_EQ(DateOf("00:01:02.5"), 62'500'000'000);
  EXPECT_EQ(DateOf("23:59:59"), 86399 * kNsPerSecond);
}

TEST(DateTime, DatesAndDurationsOfOtherWriters) {
  const TimeNs at = DateOf("2024-05-20T13:00:00.01");
  EXPECT_EQ(DateOf("05/20/2024 01:00:00.010 PM"), at);
  EXPECT_EQ(DateOf("20.05.2024 13:00:00,010"), at);
  EXPECT_EQ(DateOf("20.05.2024 12:30:00 AM"), DateOf("2024-05-20T00:30:00"));
  EXPECT_EQ(DateOf("1 days 00:00:00.010000"), 86'400'010'000'000);
  EXPECT_EQ(DateOf("00:50.010"), 50'010'000'000);
}

TEST(DateTime, OtherTextIsNone) {
  for (const char* text : {"", "12.5", "2024-05-01", "2024-13-01T00:00:00Z", "23:59", "1:02:03",
                           "2024-05-01T23:59:55X", "23:59:59 h"}) {
    EXPECT_EQ(DateOf(text), -1) << text;
  }
}

}  // namespace
}  // namespace trueline
