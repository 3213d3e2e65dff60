// The maps of config/import on the measured flights: the converted logs obey physics.
#include <algorithm>
#include <array>
#include <set>

#include "problems/log/native_log.h"
#include "problems/trajectory/mocap_path.h"
#include "tests/import/import_files.h"
#include "tests/import/physics_check.h"

namespace trueline {
namespace {

// What the logs that one map converts must fulfil.
struct Limits {
  AttitudeOf attitude;
  Thrust thrust;
  double min_correlation;  // of horizontal specific force
  double max_rms;          // m/s^2, horizontal
  double min_rate_correlation;
};
const Limits kNanoBench = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.96, 0.3, 0.9},
             kRacer = {AttitudeOf::kAhrs, Thrust::kLevelFlight, 0.6, 1.05, 0.85},
             kBebopGate = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.9, 0.6, 0.97},
             kBebopDrag = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.93, 0.16, 0.87},
             kNeuroBem = {AttitudeOf::kMocap, Thrust::kAccelerometer, 0.999, 0.03, 0.98},
             kNanoDrone = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.95, 0.35, 0.95},
             // It keeps its heading, and attitudes are held.
    kNanoDroneSquare = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.95, 0.35, 0.75},
             kThrow = {AttitudeOf::kMocap, Thrust::kAccelerometer, 0.95, 0.27, 0.98},
             kThrowByAhrs = {AttitudeOf::kAhrs, Thrust::kAccelerometer, 0.95, 0.27, 0.98};

struct Flight {
  const char* map;
  std::vector<const char*> files;
  Limits limits;
};

const std::vector<Flight> kFlights = {
    {"nanobench", {"nanobench/B7_oval_fast_rep1.csv"}, kNanoBench},
    {"nanobench", {"nanobench/B7_oval_fast_rep2.csv"}, kNanoBench},
    {"nanobench_mocap", {"nanobench/B3_figure8_fast_rep1.csv"}, kNanoBench},
    {"nanobench", {"nanobench/B3_figure8_fast_rep1.csv"}, kNanoBench},
    {"nanobench", {"nanobench/B9_trefoil_fast_rep1.csv"}, kNanoBench},
    {"li_trashcan_race", {"li_trashcan_race/6004.csv"}, kRacer},
    {"li_trashcan_race", {"li_trashcan_race/6019.csv"}, kRacer},
    {"li_bebop_gate", {"li_bebop_gate/2019-01-28_20_50_32.csv"}, kBebopGate},
    {"li_bebop_drag", {"li_bebop_drag/5deg.csv", "li_bebop_drag/take_5deg.csv"}, kBebopDrag},
    {"li_bebop_drag", {"li_bebop_drag/10deg.csv", "li_bebop_drag/take_10deg.csv"}, kBebopDrag},
    {"neurobem", {"neurobem/figure8_1_20210218170320seg2.csv"}, kNeuroBem},
    {"neurobem", {"neurobem/racetrack_1_20210218171908seg2.csv"}, kNeuroBem},
    {"idsia_nanodrone", {"idsia_nanodrone/square_20251017_run2.csv"}, kNanoDrone},
    {"idsia_nanodrone_square",
     {"nanodrone_benchmark/raw/square_20251017_run1.csv.gz"},
     kNanoDroneSquare},
    {"idsia_nanodrone", {"idsia_nanodrone/random1_20251017_run1.csv"}, kNanoDrone},
    {"indi_throw", {"indi_throw/IROS2024_LOG00230_SI.csv"}, kThrow},
    {"indi_throw", {"indi_throw/IROS2024_LOG00267_SI.csv"}, kThrowByAhrs},
};

void PrintTo(const Flight& flight, std::ostream* out) { *out << flight.files.front(); }

std::string NameOf(const testing::TestParamInfo<Flight>& info) {
  std::string name = std::string(info.param.map) + "_" +
                     std::filesystem::path(info.param.files.front()).stem().string();
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

class Flights : public testing::TestWithParam<Flight> {
 protected:
  void SetUp() override {
    for (const char* file : GetParam().files) {
      const std::filesystem::path path = DataFolder() / file;
      if (!std::filesystem::exists(path))
        GTEST_SKIP() << path << " is not there; set TRUELINE_DATA";
      files_.push_back(path.string());
    }
    log_ = ConvertLog(ShippedMap(GetParam().map), files_, {});
  }

  std::vector<std::string> files_;
  FlightLog log_;
};

TEST_P(Flights, SpecificForceIsThatOfMocap) {
  const Agreement found = CheckPhysics(log_, GetParam().limits.attitude, GetParam().limits.thrust);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_GT(found.correlation[axis], GetParam().limits.min_correlation) << "axis " << axis;
    EXPECT_LT(found.rms[axis], GetParam().limits.max_rms) << "axis " << axis;
    EXPECT_LT(std::abs(found.mean[axis]), 0.6) << "axis " << axis;
  }
  EXPECT_LT(std::abs(found.mean.z()), 0.8);
}

TEST_P(Flights, GyroIsTheTurnOfTheAttitude) {
  const Agreement found = CheckRates(log_, GetParam().limits.attitude);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(found.correlation[axis], GetParam().limits.min_rate_correlation) << "axis " << axis;
  }
}

// The AHRS's attitude and that of mocap measure the same rotation.
TEST_P(Flights, AttitudesAgree) {
  if (log_.attitude.empty()) GTEST_SKIP() << "the log has no attitude of its own";
  EXPECT_LT(AttitudeDifference(log_), 9.0);  // deg; the throws tumble
}

// Detections and sampled fixes are on the flown path. The racer's gates were up to half a metre
// from their places on its map.
TEST_P(Flights, FixesLieOnMocap) {
  std::vector<double> distances;
  for (const Fix& fix : log_.fixes) {
    const auto truth = PositionAt(log_.mocap, fix.t, 0.15);
    if (truth) distances.push_back((fix.p_E - *truth).head<2>().norm());
  }
  if (distances.empty()) GTEST_SKIP() << "the log has no fixes";
  std::nth_element(distances.begin(), distances.begin() + static_cast<int>(distances.size() / 2),
                   distances.end());
  EXPECT_LT(distances[distances.size() / 2], 0.6);
}

// A converted log is written and read again as the commands after it do.
TEST_P(Flights, CanBeReadAsANativeLog) {
  const auto directory =
      std::filesystem::path(testing::TempDir()) / ("flight_" + NameOf({GetParam(), 0}));
  WriteNativeLog(log_, directory);
  const FlightLog back = ReadNativeLog(directory);
  EXPECT_EQ(back.imu.size(), log_.imu.size());
  EXPECT_EQ(back.fixes.size(), log_.fixes.size());
  EXPECT_EQ(back.mocap.size(), log_.mocap.size());
  std::filesystem::remove_all(directory);
}

INSTANTIATE_TEST_SUITE_P(Measured, Flights, testing::ValuesIn(kFlights), NameOf);

// Maps of logs without an IMU: the labelled flights, which scripts/blind/labelled.py flies.
constexpr std::array kCommandMaps = {"crazypad_motors", "crazypad_controller", "crazyswarm_lee",
                                     "crazyswarm_lee_si"};

TEST(Maps, AllAreReadAndFlown) {
  // Those of recordings are flown in recordings_test.cc.
  std::set<std::string> flown = {"ardupilot", "betaflight", "crazyflie",   "crazyflie_commands",
                                 "euroc",     "foxglove",   "imu_and_tum", "indiflight",
                                 "px4",       "ros"};
  for (const Flight& flight : kFlights) flown.insert(flight.map);
  for (const char* map : kCommandMaps) flown.insert(map);
  for (const auto& entry : std::filesystem::directory_iterator(
           std::string(TRUELINE_TEST_SOURCE_DIR) + "/config/import")) {
    EXPECT_NO_THROW(ReadImportMap(entry.path()));
    EXPECT_EQ(flown.count(entry.path().stem().string()), 1U) << entry.path();
  }
}

}  // namespace
}  // namespace trueline
