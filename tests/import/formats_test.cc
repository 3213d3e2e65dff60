// Readers of binary formats on files of a few bytes, written here from the specifications.
#include <sqlite3.h>

#include <cstring>

#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_decoder.h"
#include "tests/import/import_files.h"
#include "tests/import/mcap_writer.h"

namespace trueline {
namespace {

using ::testing::DoubleEq;

const Channel& ChannelOf(const Recording& recording, const std::string& label) {
  for (const Channel& channel : recording.channels()) {
    if (channel.Label() == label) return channel;
  }
  ADD_FAILURE() << "no channel " << label;
  return recording.channels().front();
}

std::vector<std::string> NamesOf(const Channel& channel) {
  std::vector<std::string> names;
  for (const ChannelField& field : channel.fields) names.push_back(field.name);
  return names;
}

struct Row {
  TimeNs time;
  std::vector<double> numbers;
};

std::vector<Row> RowsOf(const std::unique_ptr<Recording>& recording, const std::string& label) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < recording->channels().size(); ++i) {
    if (recording->channels()[i].Label() != label) continue;
    recording->Visit({i}, [&](std::size_t, const Record& record) {
      rows.push_back({record.time, {}});
      for (const Cell& cell : record.cells) rows.back().numbers.push_back(cell.Number());
    });
  }
  return rows;
}

class FormatFiles : public testing::Test {
 protected:
  std::unique_ptr<Recording> Open(const std::string& text) const {
    return OpenRecording(files_.Write("log.bin", text));
  }
  std::string Refusal(const std::string& text) const {
    return ErrorOf([&] { Open(text); });
  }
  FlightLog Convert(const ImportMap& map, const std::string& log) const {
    return ConvertLog(map, {files_.Write("log.bin", log)}, {});
  }
  FlightLog ConvertWith(const std::string& map, const std::string& log) const {
    return Convert(ReadImportMap(files_.Write("map.yaml", map)), log);
  }
  FlightLog ConvertPx4(const std::string& log) const { return Convert(ShippedMap("px4"), log); }

  ImportFiles files_;
};
using Blackbox = FormatFiles;
using Crazyflie = FormatFiles;
using DamagedValues = FormatFiles;
using DataFlash = FormatFiles;
using Formats = FormatFiles;
using Mcap = FormatFiles;
using Restarts = FormatFiles;
using RosBag = FormatFiles;
using ULog = FormatFiles;

// --- ULog

std::string ULogRecord(char type, const std::string& payload) {
  return Packed(static_cast<std::uint16_t>(payload.size()), std::string(1, type) + payload);
}

// The header, and the definitions of messages.
std::string ULogStart(const std::vector<std::string>& formats) {
  std::string text = std::string("ULog\x01\x12\x35\x01", 8) + std::string(8, '\0') +
                     ULogRecord('B', std::string(40, '\0'));
  for (const std::string& format : formats) text += ULogRecord('F', format);
  return text;
}

std::string ULogSubscription(std::uint16_t id, const std::string& topic,
                             std::uint8_t instance = 0) {
  return ULogRecord('A', Packed(instance, id, topic));
}

std::string ULogData(std::uint16_t id, std::uint64_t time, std::uint64_t sample, float x) {
  return ULogRecord('D', Packed(id, time, sample, x, std::int16_t{-7}, std::string(2, '\0'),
                                std::int16_t{8}, std::string(2, '\0')));
}

std::string SmallULog(const std::string& damage) {
  return ULogStart({"topic:uint64_t timestamp;uint64_t timestamp_sample;float x;inner[2] a;"
                    "uint8_t[4] _padding0;",
                    "inner:int16_t v;uint8_t[2] _padding0;"}) +
         ULogSubscription(3, "topic") + ULogSubscription(4, "topic", 1) +
         ULogData(3, 2'000'000, 1'990'000, 0.5F) + ULogData(4, 2'100'000, 2'090'000, 1.5F) +
         damage + ULogRecord('S', "\x2f\x73\x13\x20\x25\x0c\xbb\x12") +
         ULogData(3, 3'000'000, 0, 2.5F) + "\x20";  // cut off
}

TEST_F(ULog, NestsPadsAndResynchronises) {
  const auto log = Open(SmallULog(std::string(37, '\0')));
  EXPECT_EQ(log->format().key, std::string("ulog"));
  ASSERT_EQ(log->channels().size(), 2U);
  const Channel& topic = ChannelOf(*log, "topic");
  EXPECT_THAT(NamesOf(topic),
              ElementsAre("timestamp", "timestamp_sample", "x", "a[0].v", "a[1].v"));
  EXPECT_EQ(topic.count, 2U);
  EXPECT_EQ(topic.first, 2'000'000'000);  // of recording
  EXPECT_EQ(ChannelOf(*log, "topic[1]").count, 1U);
  const std::vector<Row> rows = RowsOf(log, "topic");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].time, 1'990'000'000);  // of measurement
  EXPECT_EQ(rows[1].time, 3'000'000'000);  // which is not set
  EXPECT_THAT(rows[0].numbers, ElementsAre(2e6, 1.99e6, 0.5, -7, 8));
  EXPECT_THAT(log->warnings(), ElementsAre(HasSubstr("37 bytes, to the next synchronisation"),
                                           HasSubstr("is cut off within the record at byte")));
}

// A definition of a line may ask for more memory than there is.
TEST_F(ULog, DefinitionsLargerThanTheirMessagesCostNothing) {
  std::string text = ULogStart({"t:uint64_t timestamp;uint32_t[16000] q;"});
  for (std::uint16_t id = 0; id < 3000; ++id) {
    text += ULogSubscription(id, "t") + ULogRecord('D', Packed(id, std::uint64_t{id}));
  }
  const auto log = Open(text);
  EXPECT_TRUE(log->channels().empty());
  EXPECT_THAT(log->warnings(),
              ElementsAre(HasSubstr("3000 records are shorter than their topic's definition")));
}

// Each holds the next many times, and the last one nothing.
TEST_F(ULog, TypesWithoutBytesMayNotNestWithoutEnd) {
  std::string text = ULogStart({"t16:"});
  for (int i = 0; i < 16; ++i) text += ULogRecord('F', fmt::format("t{}:t{}[60000] x;", i, i + 1));
  text += ULogSubscription(1, "t0") + ULogRecord('D', Packed(std::uint16_t{1}));
  EXPECT_TRUE(Open(text)->channels().empty());
}

TEST_F(ULog, LeavesOutImpossibleTimes) {
  std::string text = ULogStart({"t:uint64_t timestamp;float x;"}) + ULogSubscription(1, "t");
  for (const std::uint64_t time : {~0ULL, ~0ULL >> 1, 5'000'000ULL}) {
    text += ULogRecord('D', Packed(std::uint16_t{1}, time, 0.5F));
  }
  const auto log = Open(text);
  const std::vector<Row> rows = RowsOf(log, "t");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].time, 5'000'000'000);
  EXPECT_THAT(log->warnings(), ElementsAre(HasSubstr("2 records have no possible time stamp")));
}

TEST(Cells, ATimeThatDoesNotFitLeavesTheTimeAsItWas) {
  TimeNs time = 7;
  EXPECT_FALSE(Cell(std::int64_t{1} << 62).Time(3, &time));
  EXPECT_EQ(time, 7);
}

TEST_F(ULog, RefusesUnknownFeatures) {
  std::string text = SmallULog("");
  text[16 + 3 + 8] = 2;  // an incompatible flag
  EXPECT_THAT(Refusal(text), HasSubstr("needs a newer ULog reader"));
}

TEST_F(ULog, LeavesOutMalformedDefinitions) {
  std::string text = SmallULog("");
  text.replace(text.find("int16_t v"), 9, "int16_t*v");
  const auto log = Open(text);
  EXPECT_TRUE(log->channels().empty());
  EXPECT_THAT(log->warnings(), Contains(HasSubstr("never announced")));
}

constexpr char kSensorCombined[] =
    "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;";

// A log before PX4 1.14 of an IMU and of the outputs given, one message a ms each.
std::string ULogOfOutputs(std::int32_t dshot_config, const std::vector<float>& outputs) {
  const std::string name = "int32_t DSHOT_CONFIG";
  std::string log =
      ULogStart({kSensorCombined,
                 "actuator_outputs:uint64_t timestamp;uint32_t noutputs;float[4] output;"}) +
      ULogRecord('P', Packed(static_cast<std::uint8_t>(name.size()), name, dshot_config)) +
      ULogSubscription(0, "sensor_combined") + ULogSubscription(1, "actuator_outputs");
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const std::uint64_t time = 1000 * (i + 1);
    std::string imu = Packed(std::uint16_t{0}, time);
    std::string output = Packed(std::uint16_t{1}, time, std::uint32_t{4});
    for (int k = 0; k < 6; ++k) imu += Packed(0.5F);
    for (int k = 0; k < 4; ++k) output += Packed(outputs[i]);
    log += ULogRecord('D', imu) + ULogRecord('D', output);
  }
  return log;
}

std::vector<double> FirstMotor(const FlightLog& log) {
  std::vector<double> commands;
  for (const ChannelsSample& sample : log.motors) commands.push_back(sample.values.at(0));
  return commands;
}

// Until 1.13 PX4 names the numbers of mocap x, y and z, since then position[0..2].
TEST_F(ULog, TheShippedMapReadsMocapOfOldVersions) {
  const std::uint64_t time = 1000;
  const FlightLog converted = ConvertPx4(
      ULogStart({kSensorCombined,
                 "vehicle_mocap_odometry:uint64_t timestamp;float x;float y;float z;float[4] q;"}) +
      ULogSubscription(1, "sensor_combined") + ULogSubscription(2, "vehicle_mocap_odometry") +
      ULogRecord('D', Packed(std::uint16_t{1}, time, std::string(6 * sizeof(float), '\0'))) +
      ULogRecord('D', Packed(std::uint16_t{2}, time, 1.0F, 2.0F, 3.0F, 1.0F,
                             std::string(3 * sizeof(float), '\0'))));
  EXPECT_EQ(converted.fixes.at(0).p_E, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(converted.pose.at(0).p_E, Eigen::Vector3d(1, 2, 3));
}

// Values that PWM has, too: 1000 of DShot is half of its range, of PWM it is none.
TEST_F(ULog, OutputsAreDshotWhereTheParameterSaysSo) {
  const FlightLog log = ConvertPx4(ULogOfOutputs(600, {0.0F, 110.0F, 999.5F, 1999.0F}));
  EXPECT_THAT(FirstMotor(log),
              ElementsAre(0.0, DoubleEq(110.0 / 1999.0), DoubleEq(0.5), DoubleEq(1.0)));
  EXPECT_THAT(log.warnings, Not(Contains(HasSubstr("PWM"))));
}

TEST_F(ULog, OutputsArePwmOtherwise) {
  const FlightLog log = ConvertPx4(ULogOfOutputs(0, {900.0F, 1250.0F, 2000.0F}));
  EXPECT_THAT(FirstMotor(log), ElementsAre(DoubleEq(-0.1), DoubleEq(0.25), DoubleEq(1.0)));
  EXPECT_THAT(log.warnings, Not(Contains(HasSubstr("PWM"))));
}

TEST_F(ULog, OutputsThatMayBeNoPwmAreSaid) {
  // A log that starts in flight, or PWM beside DShot.
  EXPECT_THAT(ConvertPx4(ULogOfOutputs(600, {1000.0F, 1200.0F})).warnings,
              Contains(AllOf(HasSubstr("the first output is 1000"), HasSubstr("1 / 1999"))));
  EXPECT_THAT(ConvertPx4(ULogOfOutputs(0, {1000.0F, 150.0F, 4000.0F})).warnings,
              Contains(HasSubstr("2 of 3 messages hold values that are no PWM pulses")));
}

// --- ROS messages

constexpr char kMixed[] =
    "# a comment\n"
    "uint8 FLAG=3\n"
    "bool on\n"
    "float64 wide 1.5\n"
    "string<=5 label\n"
    "int16[] some\n"
    "Part[2] parts\n"
    "builtin_interfaces/Time stamp\n"
    "================================================================================\n"
    "MSG: pkg/Part\n"
    "uint8 a\n"
    "uint32 b\n";

Row Decode(MessageDecoder* decoder, const std::string& first, const std::string& message,
           Channel* channel) {
  EXPECT_TRUE(decoder->Describe(first, channel));
  std::vector<Cell> cells(channel->fields.size());
  EXPECT_TRUE(decoder->Decode(message, &cells));
  Row row{0, {}};
  for (const Cell& cell : cells) row.numbers.push_back(cell.Number());
  return row;
}

// Every primitive is aligned to its size after the four bytes of encapsulation.
TEST(RosMessages, AreAlignedInCdr) {
  const auto message = [](const std::vector<std::int16_t>& some) {
    std::string bytes =
        Packed(std::string("\0\1\0\0\1", 5), std::string(7, '\0'), 2.25, std::uint32_t{4},
               std::string("abc\0", 4), static_cast<std::uint32_t>(some.size()));
    for (const std::int16_t value : some) bytes += Packed(value);
    const std::string gap(3, '\0');
    return bytes + Packed(std::uint8_t{9}, gap, std::uint32_t{70000}, std::uint8_t{8}, gap,
                          std::uint32_t{80000}, std::int32_t{5}, std::uint32_t{7});
  };
  const auto decoder = MakeCdrDecoder("pkg/msg/Mixed", kMixed);
  Channel channel;
  const Row row = Decode(decoder.get(), message({-1, 2}), message({-3, 4}), &channel);
  EXPECT_THAT(NamesOf(channel), ElementsAre("on", "wide", "some[0]", "some[1]", "parts[0].a",
                                            "parts[0].b", "parts[1].a", "parts[1].b", "stamp"));
  EXPECT_THAT(row.numbers, ElementsAre(1, 2.25, -3, 4, 9, 70000, 8, 80000, 5e9 + 7));
  EXPECT_EQ(channel.stamp_field, 8);
  // Cut anywhere, it is refused.
  std::vector<Cell> cells(9);
  for (std::size_t size = 0; size + 1 < message({1, 2}).size(); ++size) {
    EXPECT_FALSE(decoder->Decode(message({1, 2}).substr(0, size), &cells)) << size;
  }
}

TEST(RosMessages, ListsMayShrinkAndGrow) {
  const std::string definition = "int16[] some\nuint8 after\n";
  const auto message = [](const std::vector<std::int16_t>& some, std::uint8_t after) {
    std::string bytes = Packed(std::string("\0\1\0\0", 4), static_cast<std::uint32_t>(some.size()));
    for (const std::int16_t value : some) bytes += Packed(value);
    return bytes + Packed(after);
  };
  const auto decoder = MakeCdrDecoder("pkg/List", definition);
  Channel channel;
  const Row longer = Decode(decoder.get(), message({1, 2}, 5), message({3, 4, 9, 9}, 6), &channel);
  EXPECT_THAT(longer.numbers, ElementsAre(3, 4, 6));
  std::vector<Cell> cells(3);
  ASSERT_TRUE(decoder->Decode(message({7}, 8), &cells));
  EXPECT_EQ(cells[0].Number(), 7);
  EXPECT_TRUE(std::isnan(cells[1].Number()));
  EXPECT_EQ(cells[2].Number(), 8);
}

TEST(RosMessages, MayBeBigEndianCdr) {
  const auto decoder = MakeCdrDecoder("pkg/Two", "uint16 a\nfloat64 b\n");
  std::string number(8, '\0');
  const double value = -3.5;
  std::memcpy(number.data(), &value, 8);
  std::reverse(number.begin(), number.end());
  const std::string message = std::string("\0\0\0\0\x01\x02\0\0\0\0\0\0", 12) + number;
  Channel channel;
  EXPECT_THAT(Decode(decoder.get(), message, message, &channel).numbers, ElementsAre(258, -3.5));
}

TEST(RosMessages, ArePackedInRos1) {
  const auto decoder = MakeRos1Decoder("pkg/Old",
                                       "Header header\nuint8 a\nfloat32 b\n"
                                       "===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring "
                                       "frame_id\n");
  const std::string message =
      Packed(std::uint32_t{1}, std::uint32_t{1'700'000'000}, std::uint32_t{123'456'789},
             std::uint32_t{3}, "map", std::uint8_t{7}, 0.5F);
  Channel channel;
  Decode(decoder.get(), message, message, &channel);
  EXPECT_THAT(NamesOf(channel), ElementsAre("header.seq", "header.stamp", "a", "b"));
  std::vector<Cell> cells(4);
  ASSERT_TRUE(decoder->Decode(message, &cells));
  TimeNs stamp = 0;
  ASSERT_TRUE(cells[1].Time(0, &stamp));
  EXPECT_EQ(stamp, 1'700'000'000'123'456'789);  // more digits than a double has
}

TEST(RosMessages, UnknownTypesHaveNoFields) {
  Channel channel;
  EXPECT_FALSE(MakeCdrDecoder("pkg/None", "")->Describe(std::string(64, '\0'), &channel));
  EXPECT_FALSE(
      MakeCdrDecoder("pkg/Loop", "Loop next\n")->Describe(std::string(64, '\0'), &channel));
  EXPECT_TRUE(CommonRosTypes().contains("sensor_msgs/Imu"));
  EXPECT_EQ(RosTypeName("sensor_msgs/msg/Imu"), "sensor_msgs/Imu");
}

// Messages without bytes, six in each other over twenty levels.
TEST(RosMessages, TypesWithoutBytesMayNotNestWithoutEnd) {
  std::string definition;
  for (int i = 0; i < 20; ++i) {
    if (i > 0) definition += fmt::format("===\nMSG: p/T{}\n", i);
    for (int k = 0; k < 6; ++k) definition += fmt::format("p/T{} f{}\n", i + 1, k);
  }
  definition += "===\nMSG: p/T20\n";
  const auto decoder = MakeRos1Decoder("p/T0", definition);
  Channel channel;
  EXPECT_FALSE(decoder->Describe("", &channel));
  EXPECT_THAT(decoder->Refusal(), HasSubstr("has more than 65536 parts"));
  // Only where the message says so, and after a message that is described.
  const auto later = MakeRos1Decoder("p/T", "p/T0[] all\nuint8 a\n===\nMSG: p/T0\n" + definition);
  Channel described;
  EXPECT_TRUE(later->Describe(std::string("\0\0\0\0\7", 5), &described));
  std::vector<Cell> cells(1);
  EXPECT_FALSE(later->Decode(std::string("\2\0\0\0\7", 5), &cells));
}

TEST(RosMessages, LayoutsAreTheSameWhateverCommentsSay) {
  const std::string layout = RosLayout("p/T", "float64 a\nfloat64 b\n");
  EXPECT_EQ(layout, RosLayout("p/msg/T", "# why\nuint8 K=3\nfloat64 a # m\n\nfloat64 b\n"));
  EXPECT_NE(layout, RosLayout("p/T", "float64 b\nfloat64 a\n"));
  EXPECT_NE(layout, RosLayout("p/T", "float64 a\nfloat32 b\n"));
}

// --- ROS 1 bags

std::string BagRecord(const std::vector<std::string>& fields, const std::string& data) {
  std::string header;
  for (const std::string& field : fields) {
    header += Packed(static_cast<std::uint32_t>(field.size()), field);
  }
  return Packed(static_cast<std::uint32_t>(header.size()), header,
                static_cast<std::uint32_t>(data.size()), data);
}

std::string BagConnection(std::uint32_t id, const std::string& definition) {
  const auto field = [](const std::string& text) {
    return Packed(static_cast<std::uint32_t>(text.size()), text);
  };
  return BagRecord(
      {"op=\7", "conn=" + Packed(id), "topic=/x"},
      field("topic=/x") + field("type=p/T") + field("message_definition=" + definition));
}

std::string BagMessage(std::uint32_t id, std::uint32_t time, double a, double b) {
  return BagRecord({"op=\2", "conn=" + Packed(id), "time=" + Packed(time, std::uint32_t{0})},
                   Packed(a, b));
}

std::string BagChunk(const std::string& records) {
  return BagRecord({"op=\5", "compression=none"}, records);
}

std::string BagStart(std::uint64_t index, std::uint32_t chunks) {
  return "#ROSBAG V2.0\n" +
         BagRecord({"op=\3", "index_pos=" + Packed(index), "chunk_count=" + Packed(chunks)}, "");
}

TEST_F(RosBag, IsReadBeyondAWrongIndex) {
  const std::string connection = BagConnection(0, "float64 a\nfloat64 b\n");
  const std::string first = BagChunk(connection + BagMessage(0, 1, 1, 2));
  const std::string second = BagChunk(BagMessage(0, 2, 3, 4));
  const std::size_t start = BagStart(0, 2).size();
  const std::size_t right = start + first.size() + second.size();
  for (const std::size_t index : {right, right - second.size(), start + 5}) {
    for (const std::uint32_t chunks : {0U, 2U}) {
      const auto log = Open(BagStart(index, chunks) + first + second + connection);
      EXPECT_EQ(ChannelOf(*log, "/x").count, 2U) << index << " " << chunks;
      EXPECT_EQ(log->warnings().size(), index == right ? 0U : 1U) << index << " " << chunks;
    }
  }
}

// Each connection's messages are decoded by its own definition.
TEST_F(RosBag, ATopicMayHaveTwoDefinitions) {
  const auto log =
      Open(BagStart(0, 1) +
           BagChunk(BagConnection(0, "float64 a\nfloat64 b\n") +
                    BagConnection(1, "float64 b\nfloat64 a\n") +
                    BagConnection(2, "float64 a # again\nfloat64 b\n") + BagMessage(0, 1, 1, 2) +
                    BagMessage(1, 2, 3, 4) + BagMessage(2, 3, 5, 6)));
  ASSERT_EQ(log->channels().size(), 2U);
  EXPECT_EQ(log->channels()[0].count, 2U);
  EXPECT_THAT(NamesOf(log->channels()[0]), ElementsAre("a", "b"));
  EXPECT_THAT(NamesOf(log->channels()[1]), ElementsAre("b", "a"));
}

// --- MCAP

TEST_F(Mcap, FieldsAreThoseOfTheFullestOfTheFirstMessages) {
  const auto log =
      Open(kMcapStart + McapJson(1, "/m") + McapMessage(1, 1, R"({"w":[],"x":1})") +
           McapMessage(1, 2, R"({"w":[7,8],"x":2})") + McapMessage(1, 3, R"({"w":[9],"x":3})") +
           McapMessage(1, 4, R"({"y":[9,9,9,9]})") + McapRecord(15, "1234"));
  EXPECT_THAT(NamesOf(log->channels()[0]), ElementsAre("w[0]", "w[1]", "x"));
  const std::vector<Row> rows = RowsOf(log, "/m");
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0].numbers[2], 1);
  EXPECT_THAT(rows[1].numbers, ElementsAre(7, 8, 2));
}

TEST_F(Mcap, SaysWhatIsNotRead) {
  const std::string start = kMcapStart + McapJson(1, "/m") + McapMessage(1, 1, R"({"x":1})");
  const std::string lie = "\6" + Packed(std::uint64_t{1} << 63) + "abcd";
  EXPECT_THAT(Open(start + lie)->warnings(),
              ElementsAre(HasSubstr("so the 13 bytes from there to the end are not read")));
  const std::string chunk =
      McapRecord(6, std::string(28, '\0') + McapText("") + Packed(std::uint64_t{13}, lie));
  EXPECT_THAT(Open(start + chunk + McapRecord(15, "1234"))->warnings(),
              ElementsAre(HasSubstr("ends within a record; the 13 bytes")));
}

// --- Crazyflie

// A log of one event with one record.
std::string UsdLog(const std::vector<std::string>& variables, const std::string& values) {
  std::string log = Packed(std::uint8_t{0xBC}, std::uint16_t{2}, std::uint16_t{1}, std::uint16_t{0},
                           "fixedFrequency", '\0', static_cast<std::uint16_t>(variables.size()));
  for (const std::string& variable : variables) log += variable + '\0';
  return log + Packed(std::uint16_t{0}, std::uint64_t{1000}, values, "none");
}

// The packed words follow the firmware's description: the largest component is left out.
TEST_F(Crazyflie, UnpacksQuaternions) {
  const auto numbers = [&](std::uint32_t packed) {
    const auto log =
        Open(UsdLog({"a.b(B)", "stateEstimateZ.quat(I)"}, Packed(std::uint8_t{7}, packed)));
    EXPECT_THAT(NamesOf(log->channels()[0]),
                ElementsAre("a.b", "stateEstimateZ.quat", "stateEstimateZ.qx", "stateEstimateZ.qy",
                            "stateEstimateZ.qz", "stateEstimateZ.qw"));
    std::vector<double> row = RowsOf(log, "fixedFrequency").at(0).numbers;
    row.erase(row.begin(), row.begin() + 2);
    return row;
  };
  const auto near = [](double x) { return testing::DoubleNear(x, 1e-3); };
  constexpr std::uint32_t kSize = 434, kMinus = 1 << 9;  // 434 / 511 sqrt(1/2) = 0.6006
  EXPECT_THAT(numbers(3U << 30 | kSize << 10), ElementsAre(near(0), near(0.6), near(0), near(0.8)));
  EXPECT_THAT(numbers(kMinus | kSize), ElementsAre(near(0.8), near(0), near(0), near(-0.6)));
}

TEST_F(Crazyflie, TheShippedMapReadsAttitudesOfAllKinds) {
  const ImportMap map = ShippedMap("crazyflie");
  std::vector<std::string> variables = {"acc.x(f)",  "acc.y(f)",  "acc.z(f)",
                                        "gyro.x(f)", "gyro.y(f)", "gyro.z(f)"};
  std::string values;
  for (int i = 0; i < 6; ++i) values += Packed(1.0F);
  const auto attitude = [&](const std::vector<std::string>& more, const std::string& bytes) {
    std::vector<std::string> all = variables;
    all.insert(all.end(), more.begin(), more.end());
    return Convert(map, UsdLog(all, values + bytes)).attitude.at(0).q_Ep_I;
  };
  // 2 asin(0.6) = 73.74 deg nose up, which turns about -y of axes forward-left-up.
  constexpr std::uint32_t kNoseUp = 3U << 30 | (1 << 9 | 434) << 10;
  const Eigen::Quaterniond nose_up(0.8, 0.0, 0.6, 0.0);
  const Eigen::Quaterniond packed = attitude({"stateEstimateZ.quat(I)"}, Packed(kNoseUp));
  EXPECT_LT(packed.angularDistance(nose_up), 2e-3);
  const Eigen::Quaterniond angles =
      attitude({"stateEstimate.roll(f)", "stateEstimate.pitch(f)", "stateEstimate.yaw(f)"},
               Packed(0.0F, 73.739795F, 0.0F));
  EXPECT_LT(angles.angularDistance(nose_up), 1e-6);
}

// --- DataFlash

std::string FlashSample(std::uint64_t time, std::uint8_t sensor, std::int16_t hundredths, float x) {
  return Packed("\xA3\x95\x05", time, sensor, hundredths, x);
}

TEST_F(DataFlash, ScalesByTheLogsMultipliersAndTellsSensorsApart) {
  const std::string log_text =
      FlashFmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
      FlashFmt(5, 18, "SENS", "QBcf", "TimeUS,I,Lean,X") +
      FlashFmt(6, 20, "MULT", "Qbd", "TimeUS,Id,Mult") +
      FlashFmt(7, 76, "UNIT", "QbZ", "TimeUS,Id,Label") +
      FlashFmt(8, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds") +
      FlashSample(1'000'000, 0, 250, 4.0F) + "noise" + FlashSample(1'100'000, 1, 300, 5.0F) +
      Packed("\xA3\x95\x06", std::uint64_t{0}, "C", 1e-3) +
      Packed("\xA3\x95\x07", std::uint64_t{0}, "m", Padded("m", 64)) +
      Packed("\xA3\x95\x08", std::uint64_t{0}, std::uint8_t{5}, Padded("s#-m", 16),
             Padded("F--C", 16)) +
      FlashSample(1'200'000, 0, 260, 6.0F).substr(0, 9);
  const auto log = Open(log_text);
  EXPECT_EQ(log->format().key, std::string("dataflash"));
  const Channel& sensor = ChannelOf(*log, "SENS");
  EXPECT_EQ(sensor.count, 1U);
  EXPECT_EQ(sensor.fields[3].unit, "m");
  EXPECT_EQ(ChannelOf(*log, "SENS[1]").count, 1U);
  const std::vector<Row> rows = RowsOf(log, "SENS[1]");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].time, 1'100'000'000);
  EXPECT_THAT(rows[0].numbers, ElementsAre(1.1e6, 1, DoubleEq(3.0), DoubleEq(5e-3)));
  EXPECT_THAT(log->warnings(), ElementsAre(HasSubstr("5 bytes in 1 places are no records")));
}

// A file of two starts of a logger, of which the second has other columns: the longer one is read.
TEST_F(DataFlash, RecordsAreReadByTheDefinitionBeforeThem) {
  const std::string first = FlashFmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
                            FlashFmt(5, 18, "SENS", "QBcf", "TimeUS,I,Lean,X");
  const std::string second = FlashFmt(5, 19, "SENS", "Qff", "TimeUS,X,Y");
  const std::string sample = Packed("\xA3\x95\x05", std::uint64_t{2'000'000}, 7.0F, 8.0F);
  const auto rows_of = [&](int before, int after) {
    std::string text = first;
    for (int i = 0; i < before; ++i) text += FlashSample(1'000'000, 0, 250, 4.0F);
    text += second;
    for (int i = 0; i < after; ++i) text += sample;
    const auto log = Open(text);
    EXPECT_THAT(log->warnings(),
                ElementsAre(HasSubstr("types are defined again with other columns from byte")));
    return RowsOf(log, "SENS");
  };
  const std::vector<Row> of_first = rows_of(20, 2);
  ASSERT_EQ(of_first.size(), 20U);
  EXPECT_THAT(of_first[0].numbers, ElementsAre(1e6, 0, DoubleEq(2.5), 4));
  const std::vector<Row> of_second = rows_of(2, 20);
  ASSERT_EQ(of_second.size(), 20U);
  EXPECT_THAT(of_second[0].numbers, ElementsAre(2e6, 7, 8));
}

// --- Blackbox

BlackboxValues DecodeAll(int encoding, std::size_t fields, const std::string& bytes) {
  BlackboxHeader header;
  header.frames['I'].assign(fields, {"f", true, 0, encoding});
  ByteCursor cursor(bytes);
  BlackboxValues values;
  DecodeBlackboxFrame(header, 'I', {}, &cursor, &values);
  EXPECT_TRUE(cursor.ok());
  EXPECT_EQ(cursor.left(), 0U);
  return values;
}

TEST_F(Blackbox, Encodings) {
  EXPECT_THAT(DecodeAll(1, 2, "\x85\x01\x7F"), ElementsAre(133, 127));
  EXPECT_THAT(DecodeAll(0, 2, "\x03\x04"), ElementsAre(-2, 2));
  EXPECT_THAT(DecodeAll(3, 1, std::string("\xFF\x7F", 2)), ElementsAre(1));  // minus -1
  EXPECT_THAT(DecodeAll(6, 1, "\x03"), ElementsAre(-2));                     // without a mask
  EXPECT_THAT(DecodeAll(6, 3, "\x05\x02\x01"), ElementsAre(1, 0, -1));
  EXPECT_THAT(DecodeAll(7, 3, "\x1B"), ElementsAre(1, -2, -1));
  EXPECT_THAT(DecodeAll(7, 3, "\x47\x8F"), ElementsAre(7, -8, -1));
  EXPECT_THAT(DecodeAll(7, 3, "\xA0\x1F\x3F"), ElementsAre(-32, 31, -1));
  // One, two and three bytes; the first one's size is lowest.
  EXPECT_THAT(DecodeAll(7, 3, std::string("\xE4\xFF\x01\x80\x00\x00\x02", 7)),
              ElementsAre(-1, -32767, 0x020000));
  // 0, 4, 8 and 16 bits: nibbles 7, then -2 (FE), then 1234, high ones first.
  EXPECT_THAT(DecodeAll(8, 4, std::string("\xE4\x7F\xE1\x23\x40", 5)),
              ElementsAre(0, 7, -2, 0x1234));
  EXPECT_THAT(DecodeAll(9, 1, ""), ElementsAre(0));
  EXPECT_THAT(DecodeAll(10, 3, "\x1B"), ElementsAre(1, -2, -1));
  // 01 11111 00001 0111: -1, 1, 7.
  EXPECT_THAT(DecodeAll(10, 3, "\x7E\x17"), ElementsAre(-1, 1, 7));
  // 10 10000000 1111111 0000011: -128, -1, 3.
  EXPECT_THAT(DecodeAll(10, 3, "\xA0\x3F\x83"), ElementsAre(-128, -1, 3));
}

TEST_F(Blackbox, Predictors) {
  BlackboxHeader header;
  for (const int predictor : {1, 2, 3, 6, 8, 4}) {
    header.frames['P'].push_back({"f", true, predictor, 9});
  }
  header.min_throttle = 1070;
  const BlackboxValues before = {10, 10, -7, 10, 0, 0}, before2 = {1, 4, 2, 1, 0, 0};
  BlackboxHistory history;
  history.previous = &before;
  history.previous2 = &before2;
  history.skipped = 3;
  ByteCursor none("");
  BlackboxValues values;
  DecodeBlackboxFrame(header, 'P', history, &none, &values);
  EXPECT_THAT(values, ElementsAre(10, 16, -2, 14, 1500, 1070));
}

std::string BlackboxVarint(std::uint32_t value) {
  std::string bytes;
  for (; value > 127; value >>= 7) bytes += static_cast<char>((value & 127) | 128);
  return bytes + static_cast<char>(value);
}

constexpr char kBlackboxHeader[] =
    "H Product:Blackbox flight data recorder by Nicholas Sherlock\n"
    "H Data version:2\n"
    "H I interval:4\n"
    "H P interval:1\n"
    "H Field I name:loopIteration,time\n"
    "H Field I signed:0,0\n"
    "H Field I predictor:0,0\n"
    "H Field I encoding:1,1\n"
    "H Field P predictor:6,2\n"
    "H Field P encoding:9,0\n"
    "H Field G name:time,GPS_numSat\n"
    "H Field G signed:0,0\n"
    "H Field G predictor:10,0\n"
    "H Field G encoding:1,1\n";

// A type that holds itself a hundred times.
TEST(Protobuf, UnsetMessagesMayNotNestWithoutEnd) {
  const auto whole = [](int field, std::uint32_t value) {
    return BlackboxVarint(static_cast<std::uint32_t>(field) << 3) + BlackboxVarint(value);
  };
  const auto text = [](int field, const std::string& bytes) {
    return BlackboxVarint(static_cast<std::uint32_t>(field) << 3 | 2) +
           BlackboxVarint(static_cast<std::uint32_t>(bytes.size())) + bytes;
  };
  std::string fields;
  for (std::uint32_t i = 0; i < 100; ++i) {
    fields += text(2, text(1, fmt::format("f{}", i)) + whole(3, i + 1) + whole(4, 1) +
                          whole(5, 11) + text(6, ".A"));
  }
  const std::string file = text(1, "a.proto") + text(4, text(1, "A") + fields) + text(12, "proto3");
  const auto decoder = MakeProtobufDecoder("A", text(1, file));
  Channel channel;
  EXPECT_FALSE(decoder->Describe("", &channel));
  EXPECT_THAT(decoder->Refusal(), HasSubstr("more than 65536 parts"));
}

std::string BlackboxIntra(std::uint32_t iteration, std::uint32_t time) {
  return "I" + BlackboxVarint(iteration) + BlackboxVarint(time);
}

const std::string kBlackboxEnd(
    "E\xFF"
    "End of log\0",
    13);

std::vector<TimeNs> TimesOf(const std::vector<Row>& rows) {
  std::vector<TimeNs> times;
  times.reserve(rows.size());
  for (const Row& row : rows) times.push_back(row.time);
  return times;
}

constexpr std::uint32_t kBeforeWrap = 0xFFFFFFFFU - 2499;  // us
constexpr TimeNs kBeforeWrapNs = 1000LL * kBeforeWrap;
constexpr TimeNs kMs = 1'000'000;

// The clock of the log counts us in 32 bits: after 71 minutes it starts again at zero.
TEST_F(Blackbox, TimesGoOnWhereTheClockWraps) {
  const std::string inter = std::string("P\0", 2);  // as far from the last as that from its last
  const std::string first_inter = "P" + BlackboxVarint(2000);  // after an I frame: 1000 us later
  const std::string gps = "G" + BlackboxVarint(100) + BlackboxVarint(9);
  const auto log =
      Open(kBlackboxHeader + BlackboxIntra(0, kBeforeWrap) + first_inter + inter + gps + inter +
           gps + BlackboxIntra(4, kBeforeWrap + 4000) + first_inter + kBlackboxEnd);
  EXPECT_THAT(
      TimesOf(RowsOf(log, "main")),
      ElementsAre(kBeforeWrapNs, kBeforeWrapNs + kMs, kBeforeWrapNs + 2 * kMs,
                  kBeforeWrapNs + 3 * kMs, kBeforeWrapNs + 4 * kMs, kBeforeWrapNs + 5 * kMs));
  EXPECT_THAT(TimesOf(RowsOf(log, "gps")),
              ElementsAre(kBeforeWrapNs + 2 * kMs + kMs / 10, kBeforeWrapNs + 3 * kMs + kMs / 10));
  EXPECT_EQ(ChannelOf(*log, "main").last, kBeforeWrapNs + 5 * kMs);
  EXPECT_THAT(log->warnings(), IsEmpty());
}

// The clock wrapped in a pause of minutes. The first frame after it may be damage and is left out.
TEST_F(Blackbox, TimesGoOnWhereTheClockWrapsInAPause) {
  const std::uint32_t pause = 300'000'000;
  const auto log = Open(kBlackboxHeader + BlackboxIntra(0, kBeforeWrap) +
                        BlackboxIntra(300'000, kBeforeWrap + pause) +
                        BlackboxIntra(300'004, kBeforeWrap + pause + 4000) +
                        BlackboxIntra(300'008, kBeforeWrap + pause + 8000) + kBlackboxEnd);
  const TimeNs after = kBeforeWrapNs + 1000LL * pause;
  EXPECT_THAT(TimesOf(RowsOf(log, "main")),
              ElementsAre(kBeforeWrapNs, after + 4 * kMs, after + 8 * kMs));
}

// Betaflight adds the reason for disarming to the end's text; INAV logs failures of its filter.
TEST_F(Blackbox, EventsOfNewerFirmwareAreNoDamage) {
  const std::string failure = "E\x28\x02", end("E\xFF"
                                               "End of log (disarm reason:4)\0",
                                               31);
  const auto log = Open(kBlackboxHeader + BlackboxIntra(0, 1000) + failure +
                        BlackboxIntra(4, 5000) + end + "I am no frame");
  EXPECT_THAT(TimesOf(RowsOf(log, "main")), ElementsAre(1 * kMs, 5 * kMs));
  EXPECT_THAT(log->warnings(), IsEmpty());
}

// Coordinates are differences to the home position, which an H frame states.
TEST_F(Blackbox, GpsFramesBeforeTheHomePositionAreLeftOut) {
  const std::string header =
      std::string(kBlackboxHeader).substr(0, std::string(kBlackboxHeader).find("H Field G")) +
      "H Field H name:GPS_home[0],GPS_home[1]\n"
      "H Field H signed:1,1\n"
      "H Field H predictor:0,0\n"
      "H Field H encoding:0,0\n"
      "H Field G name:GPS_coord[0],GPS_coord[1]\n"
      "H Field G signed:1,1\n"
      "H Field G predictor:7,7\n"
      "H Field G encoding:0,0\n";
  const std::string gps = "G\x02\x04", home = "H\x14\x28";
  const std::string start = header + BlackboxIntra(0, 1000) + gps;
  const auto late = Open(start + home + gps + kBlackboxEnd);
  const std::vector<Row> rows = RowsOf(late, "gps");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_THAT(rows[0].numbers, ElementsAre(1000, 11, 22));
  EXPECT_THAT(late->warnings(), ElementsAre(HasSubstr("1 GPS frames come before the home")));
  const auto never = Open(start + gps + kBlackboxEnd);
  EXPECT_EQ(ChannelOf(*never, "gps").count, 0U);
  EXPECT_THAT(never->warnings(), ElementsAre(HasSubstr("which the log lacks")));
}

// --- ROS 2 bags

// A recorder that was killed: one message is in the bag, two are in the write-ahead log beside it.
class KilledRecorder : public FormatFiles {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(files_ / "recorder");
    std::filesystem::create_directories(files_ / "copy");
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open((files_ / "recorder/bag.db3").c_str(), &database), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(database,
                           "PRAGMA journal_mode=WAL;"
                           "PRAGMA wal_autocheckpoint=0;"
                           "CREATE TABLE topics(id INTEGER PRIMARY KEY, name, type, "
                           "serialization_format);"
                           "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id, timestamp, "
                           "data);"
                           "INSERT INTO topics VALUES(1, '/x', 'std_msgs/msg/Float32', 'cdr');"
                           "INSERT INTO messages VALUES(1, 1, 10, x'000100000000803F');"
                           "PRAGMA wal_checkpoint(TRUNCATE);"
                           "INSERT INTO messages VALUES(2, 1, 20, x'0001000000000040');"
                           "INSERT INTO messages VALUES(3, 1, 30, x'0001000000004040');",
                           nullptr, nullptr, nullptr),
              SQLITE_OK);
    for (const char* name : {"bag.db3", "bag.db3-wal"}) {
      std::filesystem::copy(files_ / "recorder" / name, files_ / "copy" / name);
    }
    ASSERT_EQ(sqlite3_close(database), SQLITE_OK);
  }

  std::filesystem::path Bag() const { return files_ / "copy/bag.db3"; }
  std::map<std::string, std::string> Files() const {  // their bytes by name
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(files_ / "copy")) {
      files[entry.path().filename().string()] = ReadText(entry.path());
    }
    return files;
  }
};

TEST_F(KilledRecorder, RowsOfTheWriteAheadLogAreRead) {
  const auto before = Files();
  ASSERT_EQ(before.size(), 2U);
  for (const std::filesystem::path& path : {Bag(), Bag().parent_path()}) {
    const auto log = OpenRecording(path);
    EXPECT_THAT(TimesOf(RowsOf(log, "/x")), ElementsAre(10, 20, 30));
    EXPECT_THAT(log->warnings(), IsEmpty());
  }
  EXPECT_EQ(Files(), before);  // the user's files stay, and none appears beside them
}

TEST_F(KilledRecorder, AWriteAheadLogThatCantBeReadIsSaid) {
  files_.Write("copy/bag.db3-wal", std::string(4096, 'x'));
  const auto log = OpenRecording(Bag());
  EXPECT_THAT(TimesOf(RowsOf(log, "/x")), ElementsAre(10));
  EXPECT_THAT(log->warnings(),
              ElementsAre(AllOf(HasSubstr("bag.db3-wal, the write-ahead log of bag.db3"),
                                HasSubstr("wal_checkpoint"))));
}

TEST_F(KilledRecorder, ABagWithoutItsWriteAheadLogIsReadAlone) {
  std::filesystem::remove(files_ / "copy/bag.db3-wal");
  const auto log = OpenRecording(Bag());
  EXPECT_THAT(TimesOf(RowsOf(log, "/x")), ElementsAre(10));
}

TEST_F(KilledRecorder, ABagFileThatIsNotListedIsSaid) {
  files_.Write("copy/metadata.yaml",
               "rosbag2_bagfile_information:\n"
               "  relative_file_paths: [bag.db3]\n");
  files_.Write("copy/other.db3", "");
  const auto log = OpenRecording(Bag().parent_path());
  EXPECT_EQ(RowsOf(log, "/x").size(), 3U);
  EXPECT_THAT(log->warnings(),
              ElementsAre(HasSubstr("has other.db3, which metadata.yaml does not list")));
}

TEST_F(KilledRecorder, AMissingPartOfABagIsSaid) {
  files_.Write("copy/metadata.yaml",
               "rosbag2_bagfile_information:\n"
               "  relative_file_paths: [bag.db3, gone.db3]\n");
  const auto log = OpenRecording(Bag().parent_path());
  EXPECT_EQ(RowsOf(log, "/x").size(), 3U);
  EXPECT_THAT(log->warnings(),
              ElementsAre(HasSubstr("metadata.yaml lists gone.db3, which is missing")));
}

TEST_F(KilledRecorder, ACutDatabaseIsNamedSo) {
  std::filesystem::remove(files_ / "copy/bag.db3-wal");
  std::filesystem::resize_file(Bag(), std::filesystem::file_size(Bag()) / 2);
  EXPECT_THAT(ErrorOf([&] { OpenRecording(Bag()); }),
              HasSubstr("is a cut or damaged sqlite3 file"));
}

// --- Restarts and damaged values

std::string FlashImu(double time, float x) {
  const auto us = static_cast<std::uint64_t>(std::llround(time * 1e6));
  return Packed("\xA3\x95\x05", us, x, 0.0F, -9.81F);
}

std::string FlashBattery(double time) {
  const auto us = static_cast<std::uint64_t>(std::llround(time * 1e6));
  return Packed("\xA3\x95\x06", us, static_cast<float>(time));
}

std::string FlashStart() {
  return FlashFmt(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns") +
         FlashFmt(5, 23, "IMU", "Qfff", "TimeUS,X,Y,Z") +
         FlashFmt(6, 15, "BAT", "Qf", "TimeUS,Volt");
}

constexpr char kFlashMap[] =
    "inputs: {log: {format: dataflash}}\n"
    "streams:\n"
    "  imu: {channel: IMU, accel: {columns: [X, Y, Z]}, gyro: {columns: [X, Y, Z]}}\n"
    "  battery: {channel: BAT, column: Volt, optional: true}\n";

// The battery has too few rows to show a restart; the IMU shows where it lies in the file.
TEST_F(Restarts, TheLongestPartIsKeptInAllStreams) {
  std::string log = FlashStart() + FlashBattery(10);
  for (int i = 0; i < 50; ++i) log += FlashImu(10.0 + 0.1 * i, 1.0F);
  log += FlashBattery(15);
  for (int i = 0; i < 80; ++i) log += FlashImu(8.0 + 0.1 * i, 2.0F);
  log += FlashBattery(16) + FlashBattery(12);
  const FlightLog converted = ConvertWith(kFlashMap, log);
  ASSERT_EQ(converted.imu.size(), 80U);
  for (const ImuSample& sample : converted.imu) EXPECT_EQ(sample.accel.x(), 2.0);
  ASSERT_EQ(converted.battery.size(), 2U);
  EXPECT_EQ(converted.battery[0].value, 12.0);
  EXPECT_THAT(
      converted.warnings,
      ElementsAre(
          AllOf(HasSubstr("the clock of 'imu' steps back once, at first from 14.700 s to 8.300 s"),
                HasSubstr("and 52 rows of the others are left out"))));
}

TEST_F(Restarts, SingleStampsAndSmallDisorderAreNone) {
  std::string log = FlashStart();
  for (int i = 0; i < 100; ++i) {
    const int swapped = i % 10 < 5 ? i : 10 * (i / 10) + 14 - i % 10;
    log += FlashImu(10.0 + 0.1 * swapped, 1.0F);
    if (i == 50) log += FlashImu(500, 1.0F);
    if (i == 70) log += FlashImu(2, 1.0F);
  }
  const FlightLog converted = ConvertWith(kFlashMap, log);
  EXPECT_EQ(converted.imu.size(), 102U);
  EXPECT_THAT(converted.warnings, Not(Contains(HasSubstr("steps back"))));
}

// Chunks may be written in another order than that of time.
TEST_F(Restarts, PartsOfABagThatDoNotOverlapAreSorted) {
  const auto convert = [&](const std::vector<double>& starts) {
    std::string log = kMcapStart + McapJson(1, "/m");
    for (const double start : starts) {
      for (int i = 0; i < 20; ++i) {
        log += McapMessage(1, static_cast<std::uint64_t>(1e9 * (start + 0.1 * i)), R"({"x":1})");
      }
    }
    return ConvertWith(
        "inputs: {log: {format: mcap}}\n"
        "streams:\n"
        "  imu: {channel: /m, accel: {columns: [x, x, x]}, gyro: {columns: [x, x, x]}}\n",
        log + McapRecord(15, "1234"));
  };
  EXPECT_EQ(convert({5.0, 2.0}).imu.size(), 40U);
  EXPECT_EQ(convert({1.0, 9.0, 5.0}).imu.size(), 60U);  // between the parts of the first
  EXPECT_EQ(convert({5.0, 4.5}).imu.size(), 20U);       // overlaps: a restart
}

TEST_F(DamagedValues, FewAreLeftOutAndManyRefused) {
  const auto log = [](int count, float x) {
    std::string text = FlashStart();
    for (int i = 0; i < 300; ++i)
      text += FlashImu(10.0 + 0.01 * i, i >= 7 && i < 7 + count ? x : 1);
    return text;
  };
  const float none = std::nanf(""), huge = 1e38F;
  const FlightLog lacks = ConvertWith(kFlashMap, log(1, none));
  EXPECT_EQ(lacks.imu.size(), 299U);
  EXPECT_THAT(lacks.warnings, Contains(AllOf(HasSubstr("1 with missing values (the first: "),
                                             HasSubstr("log.bin: IMU at 10.07"))));
  const FlightLog beyond = ConvertWith(kFlashMap, log(2, huge));
  EXPECT_EQ(beyond.imu.size(), 298U);
  EXPECT_THAT(beyond.warnings, Contains(AllOf(HasSubstr("2 with impossible values (the first: "),
                                              HasSubstr("beyond anything that flies"))));
  EXPECT_THAT(ErrorOf([&] { ConvertWith(kFlashMap, log(9, none)); }),
              AllOf(HasSubstr("log.bin: IMU at 10.07"), HasSubstr("9 of 300 rows"),
                    HasSubstr("skip_missing: true")));
  EXPECT_THAT(ErrorOf([&] { ConvertWith(kFlashMap, log(9, huge) + "noise"); }),
              AllOf(HasSubstr("the map's 'unit' or 'scale' is wrong"), HasSubstr("besides, "),
                    HasSubstr("are no records")));
}

// --- Recognition

TEST_F(Formats, AreKnownByTheContent) {
  const auto format = [&](const auto& text) -> std::string { return Open(text)->format().key; };
  EXPECT_EQ(format("# t x y z\n1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0 1\n"), "tum");
  EXPECT_EQ(format("1.5 1 2 3 0.6 0 0 0.8\n"), "tum");
  EXPECT_EQ(format("t,x\n1,2\n"), "csv");
  EXPECT_EQ(format("#ROSBAG V2.0\n"), "ros1");
  EXPECT_EQ(format("\x89MCAP0\r\n"), "mcap");
  EXPECT_THAT(Refusal(std::string("\x89HDF\r\n\x1a\n", 8)), HasSubstr("export its streams as CSV"));
  EXPECT_THAT(Refusal("\x1f\x8b more"), HasSubstr("is damaged or cut off (gzip)"));
  EXPECT_THAT(Refusal(std::string("\0\0\0\0", 4)), HasSubstr("has no format that is read here"));
  EXPECT_THAT(Refusal("SQLite format 3"), HasSubstr("ROS 2 bag"));
  EXPECT_THAT(Refusal(""), HasSubstr("has no format that is read here"));
}

TEST_F(Formats, TextMayBeCompressed) {
  const auto file = files_ / "any.gz";
  WriteCompressed(file, "t,x\n1,2\n2,3\n");
  const auto format = [&file]() -> std::string { return OpenRecording(file)->format().key; };
  EXPECT_EQ(format(), "csv");
  EXPECT_EQ(OpenRecording(file)->channels().front().count, 2U);
  WriteCompressed(file, "1.5 1 2 3 0.6 0 0 0.8\n");
  EXPECT_EQ(format(), "tum");
  WriteCompressed(file, std::string("ULog\x01\x12\x35\0", 8));
  EXPECT_THAT(ErrorOf([&] { OpenRecording(file); }), HasSubstr("any.gz: ends within its header"));
}

// Eight or twelve numbers a line may be anything.
TEST_F(Formats, TrajectoriesMustBePlausible) {
  for (const auto& [text, why] :
       {std::pair{"# a comment\n1.5 1 2 3 0 0 0 1\n1.6 1 2 3 0 0 0 2\n",
                  "line 3 has a quaternion of norm 2, not 1"},
        {"1.5 1 2 3 0 0 0 1\n1.4 1 2 3 0 0 0 1\n",
         "line 2 has a time that does not come after the one before"},
        {"1 0 0 5 0 1 0 5 0 0 1 5\n1 0 0 5 0 1 0 5 0 0 2 5\n",
         "line 2 has columns 1 to 3, 5 to 7 and 9 to 11 that are no rotation"},
        {"1 0 0 5 0 1 0 5 0 0 -1 5\n", "line 1 has columns"}}) {
    const auto log = Open(text);
    EXPECT_STREQ(log->format().key, "csv") << text;
    EXPECT_THAT(log->warnings(), Contains(HasSubstr(why))) << text;
    EXPECT_THAT(log->warnings(), Contains(HasSubstr("hold is not known"))) << text;
  }
  EXPECT_THAT(Refusal("1 0 0 5 0 0 -1 5 0 1 0 5\n"), HasSubstr("KITTI poses"));
  EXPECT_THAT(Open("1 2 3\n2 3 4\n")->warnings(), IsEmpty());
}

// One damaged row in a long trajectory does not make it another format.
TEST_F(Formats, ATrajectoryMayHaveADamagedRow) {
  std::string text;
  for (int i = 0; i < 40; ++i) text += fmt::format("{} 1 2 3 0 0 0 {}\n", i, i == 20 ? 9 : 1);
  EXPECT_STREQ(Open(text)->format().key, "tum");
}

}  // namespace
}  // namespace trueline
