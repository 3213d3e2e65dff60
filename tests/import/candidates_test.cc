// Which channel a stream is read from, where a log has several that would fit.
#include <fmt/format.h>

#include "problems/log/native_log.h"
#include "tests/import/import_files.h"
#include "tests/import/mcap_writer.h"

namespace trueline {
namespace {

constexpr char kImuType[] = "sensor_msgs/Imu";
constexpr char kPoseType[] = "geometry_msgs/PoseStamped";
constexpr char kTransformType[] = "geometry_msgs/TransformStamped";

std::string ImuMessage(bool oriented) {
  return fmt::format(
      R"({{"linear_acceleration":{{"x":0,"y":0,"z":9.8}},"angular_velocity":{{"x":0,"y":0,"z":0}},)"
      R"("orientation":{{"w":{0},"x":0,"y":0,"z":0}},"orientation_covariance":[{1}]}})",
      oriented ? 1 : 0, oriented ? 0 : -1);
}

std::string PoseMessage(double x) {
  return fmt::format(
      R"({{"pose":{{"position":{{"x":{},"y":0,"z":0}},"orientation":{{"w":1,"x":0,"y":0,"z":0}}}}}})",
      x);
}

std::string TransformMessage(double x) {
  return fmt::format(R"({{"transform":{{"translation":{{"x":{},"y":0,"z":0}},)"
                     R"("rotation":{{"w":1,"x":0,"y":0,"z":0}}}}}})",
                     x);
}

// A log of topics, each with one message again and again.
class Topics {
 public:
  Topics& Add(const std::string& topic, const std::string& type, const std::string& message,
              int count) {
    const auto id = static_cast<std::uint16_t>(++ids_);
    text_ += McapType(id, type) + McapJson(id, topic, id);
    for (int i = 0; i < count; ++i) {
      text_ += McapMessage(id, static_cast<std::uint64_t>(10'000'000 * (i + 1)), message);
    }
    return *this;
  }
  std::string str() const { return kMcapStart + text_ + McapRecord(15, "1234"); }

 private:
  std::string text_;
  int ids_ = 0;
};

class Candidates : public testing::Test {
 protected:
  FlightLog Convert(const Topics& topics) const {
    return ConvertLog(ShippedMap("ros"), {files_.Write("a.mcap", topics.str())}, {});
  }
  ImportFiles files_;
};

TEST_F(Candidates, TheAttitudeIsOfAnImuThatHasOne) {
  const FlightLog log = Convert(Topics()
                                    .Add("/imu/data_raw", kImuType, ImuMessage(false), 60)
                                    .Add("/imu/data", kImuType, ImuMessage(true), 30));
  EXPECT_EQ(log.imu.size(), 60U);
  EXPECT_EQ(log.attitude.size(), 30U);
  EXPECT_EQ(log.source.at("imu"), "/imu/data_raw");
  EXPECT_EQ(log.source.at("attitude"), "/imu/data");
  EXPECT_THAT(StreamTable(log), HasSubstr("  /imu/data_raw\n"));
  EXPECT_THAT(log.warnings,
              Contains(AllOf(HasSubstr("stream 'imu' is read from /imu/data_raw (60 usable rows)"),
                             HasSubstr("; /imu/data (30 usable rows) would do, too"))));
  EXPECT_THAT(log.warnings, Not(Contains(HasSubstr("stream 'attitude'"))));
}

// Its axes are not those of the vehicle.
TEST_F(Candidates, TheImuOfACameraCountsLast) {
  const FlightLog log = Convert(Topics()
                                    .Add("/camera/imu", kImuType, ImuMessage(false), 90)
                                    .Add("/imu/data", kImuType, ImuMessage(true), 30));
  EXPECT_EQ(log.source.at("imu"), "/imu/data");
  EXPECT_EQ(log.imu.size(), 30U);
}

TEST_F(Candidates, MocapCountsBeforeAnEstimateWhateverItsType) {
  const auto topics = [] {
    return Topics()
        .Add("/imu", kImuType, ImuMessage(true), 50)
        .Add("/fcu/local_position/pose", kPoseType, PoseMessage(1), 50);
  };
  EXPECT_EQ(Convert(topics()).source.at("mocap"), "/fcu/local_position/pose");
  EXPECT_EQ(Convert(topics().Add("/uav1/pose", kPoseType, PoseMessage(2), 20)).mocap[0].p_E.y(),
            2.0);
  const FlightLog log = Convert(topics()
                                    .Add("/uav1/pose", kPoseType, PoseMessage(2), 20)
                                    .Add("/Vicon/uav", kTransformType, TransformMessage(3), 15));
  EXPECT_EQ(log.source.at("mocap"), "/Vicon/uav");
  EXPECT_EQ(log.mocap.size(), 15U);
  EXPECT_EQ(log.mocap[0].p_E.y(), 3.0);
}

// Of a bag that does not store the definitions, for one.
TEST_F(Candidates, ATopicThatCantBeDecodedIsNotCalledMissing) {
  const FlightLog log = Convert(Topics()
                                    .Add("/imu", kImuType, ImuMessage(true), 20)
                                    .Add("/rotors", "mav_msgs/Actuators", "{", 20));
  EXPECT_THAT(log.warnings, Contains(HasSubstr("stream 'rotors' is left out: /rotors would do, but "
                                               "none of its messages can be decoded")));
  EXPECT_THAT(log.warnings, Not(Contains(HasSubstr("mav_msgs/Actuators"))));
}

TEST_F(Candidates, MoreThanFourMotorsAreReported) {
  const auto topics = [](const char* speeds) {
    return Topics()
        .Add("/imu", kImuType, ImuMessage(true), 20)
        .Add("/motors", "mav_msgs/MotorSpeed", fmt::format(R"({{"motor_speed":[{}]}})", speeds),
             20);
  };
  const auto is_reported = Contains(HasSubstr("rotors: 20 rows are of more than four motors"));
  EXPECT_THAT(Convert(topics("9,9,9,9,9,9")).warnings, is_reported);
  EXPECT_THAT(Convert(topics("9,9,9,9,0,0")).warnings, Not(is_reported));
  EXPECT_THAT(Convert(topics("9,9,9,9")).warnings, Not(is_reported));
}

// Two clocks in one stream make a mess of its order.
TEST_F(Candidates, MessagesWithoutAStampAreNotMixedWithOthers) {
  const auto convert = [&](int every, const std::string& stamp) {
    std::string text = McapType(1, kImuType) + McapJson(1, "/imu", 1);
    for (int i = 1; i <= 60; ++i) {
      const std::string set = fmt::format(
          R"("header":{{"stamp":{}}},)",
          i % every == 0 ? R"({"sec":0,"nsec":0})" : fmt::format(fmt::runtime(stamp), i));
      text += McapMessage(1, static_cast<std::uint64_t>(1'000'000'000L * (100 + i)),
                          "{" + set + ImuMessage(true).substr(1));
    }
    const std::string file = files_.Write("c.mcap", kMcapStart + text + McapRecord(15, "1234"));
    return ConvertLog(ShippedMap("ros"), {file}, {});
  };
  const FlightLog half = convert(2, R"({{"sec":{},"nsec":0}})");
  EXPECT_EQ(half.imu.size(), 30U);
  EXPECT_EQ(half.imu[0].t, kNsPerSecond);
  EXPECT_THAT(half.warnings, Contains(HasSubstr("imu: rows left out: 30 whose time of measurement "
                                                "is not set")));
  const FlightLog none = convert(1, "");
  EXPECT_EQ(none.imu.size(), 60U);
  EXPECT_EQ(none.imu[0].t, 101 * kNsPerSecond);
  EXPECT_THAT(none.warnings, Contains(HasSubstr("imu: 60 rows have no time of measurement")));
  const FlightLog text = convert(100, R"("1970-01-01T00:00:{:02}.5Z")");
  EXPECT_EQ(text.imu[0].t, kNsPerSecond * 3 / 2);
}

// A mocap system sends zeros where it does not see the vehicle.
TEST_F(Candidates, RowsThatLackValuesAreLeftOutOfBags) {
  const std::string unseen =
      R"({"pose":{"position":{"x":0,"y":0,"z":0},"orientation":{"w":0,"x":0,"y":0,"z":0}}})";
  std::string text = McapType(1, kImuType) + McapJson(1, "/imu", 1) + McapType(2, kPoseType) +
                     McapJson(2, "/vicon/uav", 2);
  for (int i = 1; i <= 100; ++i) {
    const auto time = static_cast<std::uint64_t>(10'000'000 * i);
    text += McapMessage(1, time, ImuMessage(true));
    text += McapMessage(2, time, i % 25 == 0 ? unseen : PoseMessage(i));
  }
  const std::string file = files_.Write("b.mcap", kMcapStart + text + McapRecord(15, "1234"));
  const FlightLog log = ConvertLog(ShippedMap("ros"), {file}, {});
  EXPECT_EQ(log.mocap.size(), 96U);
  EXPECT_THAT(log.warnings, Contains("mocap: rows left out: 4 with missing values"));
}

// A receiver without a fix and a pose sensor that starts up leave rows that no stream can use.
class UsableRows : public Candidates {
 protected:
  // Vision with `good` rows of 40, beside GNSS of 50 rows, at `step` (ns).
  FlightLog ConvertVision(int good, TimeNs step = 1) const {
    std::string imu = "#timestamp [ns],a[0],a[1],a[2]\n", vision = "#timestamp [ns],x,y,z\n",
                gnss = "#timestamp [ns],n,e,d\n";
    for (int i = 0; i < 50; ++i) {
      imu += fmt::format("{},0,0,-9.81\n", i * step);
      gnss += fmt::format("{},7,0,0\n", i * step);
      if (i < 40) vision += fmt::format("{},{},0,0\n", i * step, i < good ? "1" : "nan");
    }
    for (const auto& [sensor, text] :
         {std::pair{"imu0", imu}, {"vision", vision}, {"gnss", gnss}}) {
      std::filesystem::create_directories(files_ / ("log/" + std::string(sensor)));
      files_.Write(fmt::format("log/{}/data.csv", sensor), text);
    }
    const std::string map =
        "inputs: {log: {format: asl}}\n"
        "streams:\n"
        "  imu: {channel: imu0, accel: {columns: \"a[0..2]\"}, gyro: {columns: \"a[0..2]\"}}\n"
        "  fixes:\n"
        "    - {channel: vision, skip_missing: true, position: {columns: [x, y, z]},\n"
        "       sigma: {constant: 1}}\n"
        "    - {channel: gnss, position: {columns: [n, e, d]}, sigma: {constant: 1}}\n";
    return ConvertLog(ReadImportMap(files_.Write("map.yaml", map)), {(files_ / "log").string()},
                      {});
  }
};

TEST_F(UsableRows, DecideBetweenAlternatives) {
  for (const int few : {0, 3}) {
    const FlightLog log = ConvertVision(few);
    EXPECT_EQ(log.source.at("fixes"), "gnss");
    EXPECT_EQ(log.fixes.size(), 50U);
    EXPECT_THAT(log.warnings,
                Contains(HasSubstr(fmt::format("stream 'fixes' is read from gnss (50 usable rows); "
                                               "too few are in vision ({} usable rows)",
                                               few))));
  }
  EXPECT_EQ(ConvertVision(10).source.at("fixes"), "vision");
  EXPECT_EQ(ConvertVision(10).fixes.size(), 10U);
}

// A pose sensor that starts up for a moment does not replace GNSS of the whole flight.
TEST_F(UsableRows, MustCoverTheFlight) {
  const FlightLog brief = ConvertVision(12, kNsPerSecond);
  EXPECT_EQ(brief.source.at("fixes"), "gnss");
  EXPECT_THAT(brief.warnings, Contains(HasSubstr("too short a time is covered by vision (12 usable "
                                                 "rows) for 11.0 s, where that has 49.0 s")));
  const FlightLog half = ConvertVision(20, kNsPerSecond);
  EXPECT_EQ(half.source.at("fixes"), "vision");
  EXPECT_THAT(half.warnings, Contains(HasSubstr("it covers 19.0 s, and gnss (50 usable rows) for "
                                                "49.0 s would cover more")));
}

// Two receivers in one log: the first one has as many records, and no fix.
class Instances : public Candidates {
 protected:
  // The fix types of receivers, in the order in which their first records come.
  FlightLog ConvertReceivers(const std::vector<std::pair<int, int>>& instance_and_fix) const {
    std::string text = FlashFmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
                       FlashFmt(1, 35, "IMU", "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ") +
                       FlashFmt(2, 25, "GPS", "QBBLLf", "TimeUS,I,Status,Lat,Lng,Alt");
    for (int i = 0; i < 60; ++i) {
      const auto time = static_cast<std::uint64_t>(10'000 * (i + 1));
      text += Packed("\xA3\x95\x01", time);
      for (const float value : {0.0F, 0.0F, 0.0F, 0.0F, 0.0F, -9.81F}) {
        text += Packed(value);
      }
      for (const auto& [instance, fix] : instance_and_fix) {
        text += Packed("\xA3\x95\x02", time, static_cast<std::uint8_t>(instance),
                       static_cast<std::uint8_t>(fix), std::int32_t{470'000'000},
                       std::int32_t{80'000'000}, 400.0F);
      }
    }
    return ConvertLog(ShippedMap("ardupilot"), {files_.Write("a.bin", text)}, {});
  }
};

TEST_F(Instances, TheFirstWithUsableRowsIsRead) {
  const FlightLog log = ConvertReceivers({{0, 1}, {1, 3}});
  EXPECT_EQ(log.source.at("fixes"), "GPS[1]");
  EXPECT_EQ(log.fixes.size(), 60U);
  EXPECT_THAT(log.warnings, Contains(HasSubstr("stream 'fixes' is read from GPS[1] (60 usable "
                                               "rows); too few are in GPS (0 usable rows)")));
}

TEST_F(Instances, TheLowestOfThoseThatAreAsGoodIsRead) {
  const FlightLog log = ConvertReceivers({{1, 3}, {0, 3}});
  EXPECT_EQ(log.source.at("fixes"), "GPS");
  EXPECT_THAT(log.warnings, Contains(HasSubstr("; GPS[1] (60 usable rows) would do, too")));
}

}  // namespace
}  // namespace trueline
