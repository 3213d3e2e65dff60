// Logs of the formats of the field, as others wrote them: counts and stamps equal those of readers
// that share no code with this project, and the maps that ship convert them.
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/open_recording.h"
#include "problems/log/csv_text.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

std::filesystem::path Logs() { return DataFolder() / "../logs"; }

#define SKIP_WITHOUT_LOGS() \
  if (!std::filesystem::exists(Logs())) GTEST_SKIP() << Logs() << " is missing"

nlohmann::json Expected() { return nlohmann::json::parse(std::ifstream(Logs() / "expected.json")); }

struct Seen {
  std::size_t count = 0;
  TimeNs first = 0, last = 0;
};

// Channels by name, instances together.
std::map<std::string, Seen> SeenIn(const Recording& recording) {
  std::map<std::string, Seen> seen;
  for (const Channel& channel : recording.channels()) {
    const auto [entry, is_new] = seen.try_emplace(channel.name, Seen{0, channel.first, 0});
    entry->second.first = std::min(entry->second.first, channel.first);
    entry->second.last = std::max(entry->second.last, channel.last);
    entry->second.count += channel.count;
  }
  return seen;
}

Seen Of(const nlohmann::json& stream) {
  Seen seen{stream.at("count"), 0, 0};
  if (seen.count == 0) return seen;
  for (const auto& [unit, scale] : {std::pair{"ns", 1}, {"us", 1000}}) {
    if (!stream.contains(std::string("first_") + unit)) continue;
    seen.first = stream.at(std::string("first_") + unit).get<TimeNs>() * scale;
    seen.last = stream.at(std::string("last_") + unit).get<TimeNs>() * scale;
  }
  if (stream.contains("first_s")) {
    seen.first = std::llround(stream.at("first_s").get<double>() * 1e6) * 1000;
    seen.last = std::llround(stream.at("last_s").get<double>() * 1e6) * 1000;
  }
  return seen;
}

void ExpectSame(const std::string& file, const std::string& stream, const Seen& found,
                const Seen& expected) {
  EXPECT_EQ(found.count, expected.count) << file << ": " << stream;
  if (expected.count == 0 || expected.last == 0) return;
  EXPECT_EQ(found.first, expected.first) << file << ": " << stream;
  EXPECT_EQ(found.last, expected.last) << file << ": " << stream;
}

// All files of a folder for which expected.json gives streams. Returns how many there were.
int CompareFolder(const std::string& folder, const std::vector<std::string>& apart) {
  int compared = 0;
  const nlohmann::json all = Expected();
  for (const auto& [file, entry] : all.items()) {
    const bool skip = std::find(apart.begin(), apart.end(), file) != apart.end();
    if (!file.starts_with(folder + "/") || !entry.contains("streams") || skip) continue;
    const auto recording = OpenRecording(Logs() / file);
    const auto seen = SeenIn(*recording);
    for (const auto& [stream, value] : entry.at("streams").items()) {
      const auto found = seen.find(stream);
      ExpectSame(file, stream, found == seen.end() ? Seen{} : found->second, Of(value));
    }
    ++compared;
  }
  return compared;
}

TEST(Recordings, BagsHaveTheirMessages) {
  SKIP_WITHOUT_LOGS();
  EXPECT_EQ(CompareFolder("ros1", {"ros1/unsorted_chunks.bag"}), 7);
  EXPECT_EQ(CompareFolder("ros2", {}), 13);
  EXPECT_EQ(CompareFolder("mcap", {}), 9);
}

TEST(Recordings, ChunksMayBeOutOfOrder) {
  SKIP_WITHOUT_LOGS();
  const auto bag = OpenRecording(Logs() / "ros1/unsorted_chunks.bag");
  ASSERT_EQ(bag->channels().size(), 1U);
  EXPECT_EQ(bag->channels()[0].count, 3U);
  EXPECT_EQ(bag->channels()[0].first, 2'000'000'000);  // in the order of the file
}

// FMTU is not in the order of time.
TEST(Recordings, DataFlashLogsHaveTheirMessages) {
  SKIP_WITHOUT_LOGS();
  EXPECT_EQ(
      CompareFolder("ardupilot",
                    {"ardupilot/sitl_vtol_mavlink1.tlog", "ardupilot/sitl_copter_mavlink2_cut.tlog",
                     "ardupilot/copter46_cut_80k.bin", "ardupilot/plane46_armed_cubeorange.bin"}),
      2);
  const auto plane = OpenRecording(Logs() / "ardupilot/plane46_armed_cubeorange.bin");
  EXPECT_EQ(SeenIn(*plane).at("IMU").count, 37056U);
  EXPECT_NEAR(ToSeconds(SeenIn(*plane).at("MSG").last), 526.8, 0.1);
}

TEST(Recordings, CrazyflieLogsHaveTheirEvents) {
  SKIP_WITHOUT_LOGS();
  EXPECT_EQ(CompareFolder("crazyflie", {}), 4);
}

// Topics have their instance in the name there.
TEST(Recordings, ULogsHaveTheirTopics) {
  SKIP_WITHOUT_LOGS();
  const nlohmann::json all = Expected();
  int compared = 0;
  for (const auto& [file, entry] : all.items()) {
    if (!file.starts_with("ulog/")) continue;
    const auto recording = OpenRecording(Logs() / file);
    std::size_t messages = 0;
    for (const Channel& channel : recording->channels()) {
      messages += channel.count;
      const std::string name = fmt::format("{}[{}]", channel.name, channel.instance);
      if (file == "ulog/corrupt_lost_framing.ulg") continue;  // its counts end at the damage
      const auto expected = entry.at("streams").find(name);
      ASSERT_NE(expected, entry.at("streams").end()) << file << ": " << name;
      EXPECT_EQ(channel.count, expected->at("count").get<std::size_t>()) << file << ": " << name;
      EXPECT_EQ(channel.first, expected->at("first_us").get<TimeNs>() * 1000) << file << name;
      EXPECT_EQ(channel.last, expected->at("last_us").get<TimeNs>() * 1000) << file << name;
    }
    const auto data = entry.contains("after_resync") ? entry.at("after_resync").at("data")
                                                     : entry.at("messages").at("D");
    EXPECT_EQ(messages, data.get<std::size_t>()) << file;
    ++compared;
  }
  EXPECT_EQ(compared, 9);
}

TEST(Recordings, DamageIsSaidWithItsPlace) {
  SKIP_WITHOUT_LOGS();
  const auto lost = OpenRecording(Logs() / "ulog/corrupt_lost_framing.ulg");
  ASSERT_EQ(lost->warnings().size(), 2U);
  EXPECT_THAT(lost->warnings()[0], HasSubstr("no record at byte 1178047"));
  EXPECT_THAT(lost->warnings()[1], HasSubstr("no record at byte 3473065"));
  const auto zeros = OpenRecording(Logs() / "ulog/corrupt_zero_tail.ulg");
  EXPECT_THAT(zeros->warnings(), ElementsAre(HasSubstr("byte 751530: 710999 bytes, to the "
                                                       "end, are empty or damaged")));
  const auto open = OpenRecording(Logs() / "mcap/nanobench_trefoil_unfinished.mcap");
  EXPECT_THAT(open->warnings(), ElementsAre(HasSubstr("was never closed")));
}

// A recorder that was killed leaves no index; the open chunk of the uncompressed bag can be read.
TEST(Recordings, ActiveBagsAreReadAsFarAsTheyGo) {
  SKIP_WITHOUT_LOGS();
  for (const auto& [file, least, most] :
       {std::tuple{"ros1/nanobench_trefoil_lz4.bag.active", 4019, 4019},
        {"ros1/nanobench_trefoil_none.bag.active", 4019, 4100}}) {
    int messages = 0;
    const auto recording = OpenRecording(Logs() / file);
    for (const Channel& channel : recording->channels()) {
      messages += static_cast<int>(channel.count);
    }
    EXPECT_GE(messages, least) << file;
    EXPECT_LE(messages, most) << file;
  }
}

// The raw integers of a session equal those that another decoder wrote as CSV. Its first column
// counts rows.
void CompareBlackbox(const std::string& file, const std::string& table, int instance,
                     std::size_t least) {
  const auto recording = OpenRecording(Logs() / file);
  std::size_t channel = 0;
  for (std::size_t i = 0; i < recording->channels().size(); ++i) {
    const Channel& one = recording->channels()[i];
    if (one.name == "main" && one.instance == instance) channel = i;
  }
  std::vector<std::string> warnings;
  ForeignCsv csv(Logs() / table, CsvDialect{}, &warnings);
  std::vector<std::pair<int, int>> columns;  // of the table and of the channel
  std::map<TimeNs, std::vector<double>> by_time;
  {
    std::ifstream in(Logs() / table);
    std::string header;
    std::getline(in, header);
    std::vector<std::string_view> texts;
    SplitFields(header, ',', &texts);
    for (std::size_t i = 1; i < texts.size(); ++i) {
      const std::string name(texts[i] == "time (us)" ? "time" : texts[i]);
      const int index = recording->channels()[channel].IndexOf(name);
      if (index >= 0) columns.emplace_back(static_cast<int>(i), index);
    }
  }
  const int time = recording->channels()[channel].IndexOf("time");
  recording->Visit({channel}, [&](std::size_t, const Record& record) {
    std::vector<double>& row =
        by_time[std::llround(record.cells[static_cast<std::size_t>(time)].Number())];
    for (const auto& [in_table, in_channel] : columns) {
      row.push_back(record.cells[static_cast<std::size_t>(in_channel)].Number());
    }
  });
  std::size_t compared = 0;
  while (csv.Next()) {
    const auto found = by_time.find(std::llround(csv.Number(1)));
    if (found == by_time.end()) continue;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      ASSERT_EQ(found->second[k], csv.Number(columns[k].first))
          << table << ":" << csv.line() << ": column " << columns[k].first + 1;
    }
    ++compared;
  }
  EXPECT_GE(compared, least) << table;
  EXPECT_GT(columns.size(), 20U);
}

TEST(Recordings, BlackboxFramesEqualOtherDecoders) {
  SKIP_WITHOUT_LOGS();
  const std::string folder = "betaflight/";
  CompareBlackbox(folder + "bf42_two_logs.bbl", folder + "bf42_two_logs.01.csv", 0, 87);
  CompareBlackbox(folder + "bf42_two_logs.bbl", folder + "bf42_two_logs.02.first1500.csv", 1, 1500);
  CompareBlackbox(folder + "bf42_gps_home_moved.BFL",
                  folder + "bf42_gps_home_moved.01.first2000.csv", 0, 2000);
  CompareBlackbox(folder + "indiflight_LOG00271.BFL", folder + "indiflight_LOG00271.first1500.csv",
                  0, 1500);
}

TEST(Recordings, BlackboxSessionsAndDamage) {
  SKIP_WITHOUT_LOGS();
  const auto count = [](const Recording& recording, const std::string& label) {
    for (const Channel& channel : recording.channels()) {
      if (channel.Label() == label) return channel.count;
    }
    return std::size_t{0};
  };
  const auto two = OpenRecording(Logs() / "betaflight/bf42_two_logs.bbl");
  EXPECT_EQ(count(*two, "main"), 98U);
  EXPECT_EQ(count(*two, "main[1]"), 24893U);
  EXPECT_EQ(two->preferred_instance(), 1);
  const auto home = OpenRecording(Logs() / "betaflight/bf42_gps_home_moved.BFL");
  EXPECT_EQ(count(*home, "main"), 16774U);
  EXPECT_EQ(count(*home, "gps"), 86U);
  EXPECT_EQ(count(*home, "slow"), 3U);
  const auto indi = OpenRecording(Logs() / "betaflight/indiflight_LOG00271.BFL");
  EXPECT_EQ(count(*indi, "main"), 4192U);
  const auto damaged = OpenRecording(Logs() / "betaflight/error_recovery.bbl");
  EXPECT_EQ(count(*damaged, "main"), 2U);
  EXPECT_THAT(damaged->warnings(), ElementsAre(HasSubstr("5 main frames are left out")));
}

// Every message of the usual packages, in both storages, decodes to its end.
TEST(Recordings, EveryUsualRos2MessageIsDecoded) {
  SKIP_WITHOUT_LOGS();
  const auto sqlite = OpenRecording(Logs() / "ros2/all_types_sqlite3");
  const auto mcap = OpenRecording(Logs() / "ros2/all_types_mcap");
  const auto numbers = [](Recording* recording) {
    std::map<std::string, std::vector<std::string>> cells;
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < recording->channels().size(); ++i) {
      if (!recording->channels()[i].fields.empty()) all.push_back(i);
    }
    for (const std::size_t undecoded : recording->Visit(all, [&](std::size_t i, const Record&r) {
           const Channel& channel = recording->channels()[i];
           for (std::size_t k = 0; k < r.cells.size(); ++k) {
             if (channel.fields[k].unit == "ns")
               continue;  // the bags were made one after the other
             cells[channel.name].emplace_back(r.cells[k].Bytes());
           }
         })) {
      EXPECT_EQ(undecoded, 0U);
    }
    return cells;
  };
  const auto from_sqlite = numbers(sqlite.get());
  EXPECT_GE(from_sqlite.size(), 90U);
  EXPECT_EQ(from_sqlite, numbers(mcap.get()));
}

// --- The same ten seconds of one flight in every container.

constexpr char kTable[] =
    "inputs: {log: {time: {column: t, unit: s}}}\n"
    "earth: NWU\nbody: FLU\n"
    "streams:\n"
    "  imu:\n"
    "    accel: {columns: [imu_acc_x, imu_acc_y, imu_acc_z], unit: g}\n"
    "    gyro: {columns: [imu_gyro_x, imu_gyro_y, imu_gyro_z], unit: rad/s}\n"
    "  mocap:\n"
    "    position: {columns: [px, py, pz], unit: m}\n"
    "    quaternion: {w: qw, x: qx, y: qy, z: qz}\n"
    "  motors:\n"
    "    columns: [motor_motor_m1, motor_motor_m2, motor_motor_m3, motor_motor_m4]\n"
    "    scale: 1.52590218966964e-5\n"
    "cut: {from: 7, to: 16.995}\n";

class SameFlight : public testing::Test {
 protected:
  void SetUp() override {
    SKIP_WITHOUT_LOGS();
    table_ = ConvertLog(ReadImportMap(files_.Write("table.yaml", kTable)),
                        {(DataFolder() / "nanobench/B9_trefoil_fast_rep1.csv").string()}, {});
    ASSERT_EQ(table_.imu.size(), 1000U);
  }

  // `map` is a file of config/import, with x taken as north as in the table.
  FlightLog Convert(const std::string& map, const std::string& file, const std::string& more = "",
                    const std::string& body = "") {
    std::string text = ReadText(ShippedMapFile(map));
    const auto replace = [&text](const std::string& from, const std::string& to) {
      const std::size_t place = text.find(from);
      if (place != std::string::npos) text.replace(place, from.size(), to);
    };
    replace("earth: ENU", "earth: NWU");
    if (!body.empty()) replace("body: {axes: [z, y, -x]}", "body: " + body);
    return ConvertLog(ReadImportMap(files_.Write("map.yaml", text + more)),
                      {(Logs() / file).string()}, {});
  }

  void ExpectSamePoses(const std::string& file, const FlightLog& log, std::size_t count) const {
    ASSERT_EQ(log.mocap.size(), count) << file;
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(log.mocap[i].t, table_.mocap[i].t) << file << " " << i;
      ASSERT_EQ(log.mocap[i].p_E, table_.mocap[i].p_E) << file << " " << i;
      ASSERT_EQ(log.mocap[i].q_E.coeffs(), table_.mocap[i].q_E.coeffs()) << file << " " << i;
    }
  }
  void ExpectSameImu(const std::string& file, const FlightLog& log, std::size_t count) const {
    ASSERT_EQ(log.imu.size(), count) << file;
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(log.imu[i].t, table_.imu[i].t) << file << " " << i;
      ASSERT_EQ(log.imu[i].accel, table_.imu[i].accel) << file << " " << i;
      ASSERT_EQ(log.imu[i].gyro, table_.imu[i].gyro) << file << " " << i;
    }
  }

  ImportFiles files_;
  FlightLog table_;
};

// The PWM message has no header: it is stamped when recorded, 3 ms late.
constexpr char kMotors[] =
    "  motors: {channel: /motors, columns: \"data[0..3]\", scale: 1.52590218966964e-5, time: "
    "{offset: -0.003}}\n";

TEST_F(SameFlight, FromBags) {
  for (const char* file :
       {"ros1/nanobench_trefoil_none.bag", "ros1/nanobench_trefoil_lz4.bag",
        "ros1/nanobench_trefoil_bz2.bag", "ros2/nanobench_trefoil",
        "ros2/nanobench_trefoil/trefoil_0.db3", "mcap/nanobench_trefoil_none.mcap",
        "mcap/nanobench_trefoil_lz4.mcap", "mcap/nanobench_trefoil_zstd.mcap",
        "mcap/nanobench_trefoil_unchunked.mcap"}) {
    const FlightLog log = Convert("ros", file, kMotors);
    ExpectSameImu(file, log, 1000);
    ExpectSamePoses(file, log, 1000);
    ASSERT_EQ(log.motors.size(), 1000U) << file;
    for (std::size_t i = 0; i < 1000; ++i) {
      ASSERT_NEAR(static_cast<double>(log.motors[i].t - table_.motors[i].t), 0.0, 2.0) << file;
      for (std::size_t k = 0; k < 4; ++k) {  // whole counts in the bags
        ASSERT_NEAR(log.motors[i].values[k], table_.motors[i].values[k], 0.51 / 65535) << file;
      }
    }
    EXPECT_EQ(log.battery.size(), 100U) << file;
  }
}

TEST_F(SameFlight, FromOtherContainers) {
  const auto expect_same = [&](const std::string& file, const FlightLog& log, std::size_t imu,
                               std::size_t poses) {
    ExpectSameImu(file, log, imu);
    ExpectSamePoses(file, log, poses);
  };
  for (const char* file :
       {"mcap/nanobench_trefoil_json.mcap", "mcap/nanobench_trefoil_protobuf.mcap"}) {
    expect_same(file, Convert("foxglove", file), 1000, 1000);
  }
  const std::string unfinished = "mcap/nanobench_trefoil_unfinished.mcap";
  expect_same(unfinished, Convert("ros", unfinished), 913, 912);
  // This folder's IMU is mounted forward-left-up, as EuRoC's is not.
  const std::string asl = "trajectories/euroc_nanobench";
  expect_same(asl, Convert("euroc", asl, "", "FLU"), 1000, 1000);
}

TEST_F(SameFlight, FromATumTrajectoryBesideAnotherLog) {
  const FlightLog log = ConvertLog(
      ReadImportMap(files_.Write(
          "map.yaml",
          "inputs: {log: {format: mcap}, truth: {format: tum}}\nearth: NWU\nbody: FLU\n"
          "streams:\n"
          "  imu: {channel: /imu, accel: {columns: [linear_acceleration.x, linear_acceleration.y, "
          "linear_acceleration.z]}, gyro: {columns: [angular_velocity.x, angular_velocity.y, "
          "angular_velocity.z]}}\n"
          "  mocap: {input: truth, channel: trajectory, position: {columns: [tx, ty, tz]}, "
          "quaternion: {w: qw, x: qx, y: qy, z: qz}}\n")),
      {(Logs() / "mcap/nanobench_trefoil_json.mcap").string(),
       (Logs() / "trajectories/tum_nanobench_trefoil.txt").string()},
      {});
  ExpectSamePoses("tum", log, 1000);
}

// --- Maps that ship.

struct Shipped {
  const char* file;
  const char* map;
  std::size_t imu, fixes, mocap;
};

TEST(ShippedMaps, AreFoundByContentAndConvert) {
  SKIP_WITHOUT_LOGS();
  for (const Shipped& one : {Shipped{"ulog/indoor_vision.ulg", "px4", 8189, 209, 0},
                             {"ulog/v0_sitl_gps_truncated.ulg", "px4", 4944, 99, 0},
                             {"ulog/sitl_groundtruth.ulg", "px4", 4445, 260, 257},
                             {"ros1/nanobench_trefoil_lz4.bag", "ros", 1000, 1000, 1000},
                             {"mcap/nanobench_trefoil_json.mcap", "foxglove", 1000, 0, 1000},
                             {"ardupilot/plane46_armed_cubeorange.bin", "ardupilot", 12353, 158, 0},
                             {"ardupilot/sitl_copter_esc_sim.BIN", "ardupilot", 635, 127, 254},
                             {"betaflight/bf42_gps_home_moved.BFL", "betaflight", 16774, 86, 0},
                             {"betaflight/indiflight_LOG00271.BFL", "indiflight", 4192, 0, 167},
                             {"crazyflie/terrain_log07", "crazyflie", 17005, 4251, 0},
                             {"crazyflie/lee_log100", "crazyflie_commands", 0, 1443, 0},
                             {"trajectories/euroc_v101_cut", "euroc", 1600, 0, 160}}) {
    const std::string file = (Logs() / one.file).string();
    const auto map = FindShippedMap(*OpenRecording(file));
    ASSERT_TRUE(map.has_value()) << file;
    EXPECT_EQ(std::filesystem::path(map->file).stem(), one.map) << file;
    const FlightLog log = ConvertLog(*map, {file}, {});
    EXPECT_EQ(log.imu.size(), one.imu) << file;
    EXPECT_EQ(log.fixes.size(), one.fixes) << file;
    EXPECT_EQ(log.mocap.size(), one.mocap) << file;
    for (const std::string& lack : Shortcomings(log, file)) {
      EXPECT_THAT(lack, testing::AnyOf(HasSubstr("the IMU is logged at 25 Hz"),
                                       HasSubstr("has no IMU; only trueline diagnose --against")))
          << file;
    }
  }
}

std::string WhyUnusable(const std::string& name) {
  const std::string file = (Logs() / name).string();
  const auto map = FindShippedMap(*OpenRecording(file));
  if (!map) return "no map";
  try {
    const auto lacks = Shortcomings(ConvertLog(*map, {file}, {}), file);
    return lacks.empty() ? "usable" : lacks.front();
  } catch (const NoUsableLog& error) {
    return error.what();
  } catch (const InputError& error) {
    return std::string("bad input: ") + error.what();
  }
}

TEST(ShippedMaps, SayWhatAnUnusableLogLacks) {
  SKIP_WITHOUT_LOGS();
  EXPECT_THAT(WhyUnusable("ulog/esc_rpm_gps.ulg"), HasSubstr("too slowly to integrate; log it at"));
  EXPECT_THAT(WhyUnusable("ulog/appended_multiple.ulg"), HasSubstr("has no position"));
  EXPECT_THAT(WhyUnusable("betaflight/bf42_two_logs.bbl"), HasSubstr("has no position"));
  EXPECT_THAT(WhyUnusable("ros2/rosbag2_test"), HasSubstr("bad input: "));
  EXPECT_THAT(WhyUnusable("ros2/rosbag2_test"), HasSubstr("the quaternion's norm is"));
  EXPECT_EQ(WhyUnusable("ros1/rotors_waypoint.bag"), "no map");
  EXPECT_EQ(WhyUnusable("ros1/no_messages.bag"), "no map");
}

TEST(ShippedMaps, TumBesidePx4) {
  SKIP_WITHOUT_LOGS();
  const FlightLog log =
      ConvertLog(ShippedMap("imu_and_tum"),
                 {(Logs() / "ulog/indoor_vision.ulg").string(),
                  (Logs() / "trajectories/tum_freiburg1_xyz_first1000.txt").string()},
                 {});
  EXPECT_EQ(log.mocap.size(), 1000U);
  EXPECT_EQ(log.imu.size(), 8189U);
  EXPECT_EQ(log.attitude.size(), 830U);
  EXPECT_EQ(log.motors.size(), 416U);
}

TEST(Recordings, RefusesWhatItDoesNotReadWithARemedy) {
  SKIP_WITHOUT_LOGS();
  const auto error = [](const std::string& file) {
    return ErrorOf([&] { OpenRecording(Logs() / file); });
  };
  EXPECT_THAT(error("ardupilot/sitl_vtol_mavlink1.tlog"),
              HasSubstr("download the autopilot's own"));
  EXPECT_THAT(error("ardupilot/sitl_copter_mavlink2_cut.tlog"), HasSubstr("MAVLink telemetry"));
  EXPECT_THAT(error("trajectories/kitti_00_first500.txt"), HasSubstr("KITTI poses"));
  EXPECT_THAT(error("nowhere.ulg"), HasSubstr("does not exist"));
}

// Cut and overwritten anywhere, a log gives an error for the user or fewer messages, and no crash.
TEST(Recordings, SurviveDamage) {
  SKIP_WITHOUT_LOGS();
  const ImportFiles files;
  for (const char* name :
       {"ulog/fmu6c_motors_servos.ulg", "ros1/nanobench_trefoil_lz4.bag",
        "ros1/unsorted_chunks.bag", "mcap/nanobench_trefoil_zstd.mcap",
        "mcap/nanobench_trefoil_protobuf.mcap", "mcap/nanobench_trefoil_json.mcap",
        "mcap/rosbag2_galactic_part_0.mcap", "ros2/all_types_sqlite3/test_bag_sqlite3.db3",
        "ros2/split_file_zstd/file_compression_0.db3.zstd", "ardupilot/plane38_cut_64k.BIN",
        "betaflight/error_recovery.bbl", "crazyflie/lee_log100"}) {
    std::ifstream in(Logs() / name, std::ios::binary);
    const std::string good(std::istreambuf_iterator<char>(in), {});
    for (std::uint32_t seed = 1; seed <= 12; ++seed) {
      std::string bytes = good;
      std::uint32_t state = seed * 2654435761U;
      for (int k = 0; k < 40; ++k) {
        state = state * 1664525U + 1013904223U;
        bytes[(state >> 4) %
              (seed % 2 == 0 ? bytes.size() : std::min<std::size_t>(4096, bytes.size()))] =
            static_cast<char>(state >> 24);
      }
      if (seed % 3 == 0) bytes.resize(bytes.size() * (seed % 7 + 1) / 8);
      const std::string file = files.Write("damaged", bytes);
      try {
        const auto recording = OpenRecording(file);
        std::vector<std::size_t> all;
        for (std::size_t i = 0; i < recording->channels().size(); ++i) all.push_back(i);
        recording->Visit(all, [](std::size_t, const Record&) {});
      } catch (const InputError&) {  // the user is told
      }
    }
  }
}

}  // namespace
}  // namespace trueline
