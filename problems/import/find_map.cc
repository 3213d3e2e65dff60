#include "problems/import/find_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "problems/common/app.h"
#include "problems/common/units.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/resolve_channels.h"
#include "problems/log/imu_health.h"

namespace trueline {
namespace {

constexpr std::size_t kLeastImuSamples = 3;
constexpr double kMaxLean = 60.0;  // deg, of the mean specific force from -z

std::vector<std::filesystem::path> ShippedMaps() {
  std::vector<std::filesystem::path> maps;
  for (const auto& entry : std::filesystem::directory_iterator(FindShared("config/import"))) {
    if (entry.path().extension() == ".yaml") maps.push_back(entry.path());
  }
  std::sort(maps.begin(), maps.end());
  return maps;
}

// CSV: a map knows a file by the names of its columns, so it must read a header.
bool ReadsNamesOf(const InputMap& input, const Recording& recording) {
  const CsvLayout layout = GuessCsvLayout(recording.file());
  return input.dialect.header && input.dialect.skip_lines == layout.skip_lines && layout.header &&
         input.dialect.units_line == layout.units_line && layout.warning.empty() &&
         input.dialect.separators == layout.separators;
}

bool IsFor(const ImportMap& map, const Recording& recording) {
  if (map.inputs.size() != 1) return false;
  const std::vector<std::string>& formats = map.inputs.front().formats;
  if (recording.format().key == std::string(kCsvFormat)) {
    return formats.empty() && ReadsNamesOf(map.inputs.front(), recording);
  }
  return std::find(formats.begin(), formats.end(), recording.format().key) != formats.end();
}

Eigen::Vector3d MeanForce(const FlightLog& log) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : log.imu) sum += sample.accel;
  return sum / static_cast<double>(log.imu.size());
}

}  // namespace

std::optional<ImportMap> FindShippedMap(const Recording& recording) {
  std::optional<ImportMap> best;
  int most = 0;
  for (const std::filesystem::path& path : ShippedMaps()) {
    const ImportMap map = ReadImportMap(path);
    const int count = IsFor(map, recording) ? CountStreams(map, recording) : 0;
    if (count > most) best = map;
    most = std::max(most, count);
  }
  return best;
}

std::vector<std::string> Shortcomings(const FlightLog& log, const std::string& file) {
  std::vector<std::string> found;
  if (log.imu.empty() && !log.motors.empty()) {
    return {file + ": has no IMU; only trueline-diagnose --against reads it"};
  }
  if (log.imu.size() < kLeastImuSamples) {
    throw NoUsableLog(fmt::format(
        "{}: the IMU has no more than {} samples, which are no flight; log it at 100 Hz or more",
        file, log.imu.size()));
  }
  const double rate = 1.0 / MedianStep(log.imu);
  if (rate > kFastestImuRate) {
    throw NoUsableLog(fmt::format(
        "{}: the IMU is logged at {:.3g} Hz, faster than any sensor; state the unit of its time",
        file, rate));
  }
  if (!(rate >= kLeastImuRate)) {
    throw NoUsableLog(fmt::format(
        "{}: the IMU is logged at {:.3g} Hz, too slowly to integrate; log it at 100 Hz or more "
        "(PX4: SDLOG_PROFILE with high rate; ArduPilot: LOG_BITMASK with fast IMU)",
        file, rate));
  }
  if (rate < kUsualImuRate) {
    found.push_back(
        fmt::format("{}: the IMU is logged at {:.3g} Hz; below 100 Hz fast manoeuvres "
                    "are integrated poorly, so log it faster if you can",
                    file, rate));
  }
  if (log.fixes.empty() && log.mocap.empty()) {
    throw NoUsableLog(file +
                      ": has no position: neither GNSS nor vision nor mocap; log one of them, or "
                      "give a trajectory as a second input of a map");
  }
  const Eigen::Vector3d force = MeanForce(log);
  const double lean = std::acos(std::clamp(-force.z() / force.norm(), -1.0, 1.0)) / kDegree;
  if (!(lean < kMaxLean)) {
    found.push_back(
        fmt::format("{}: the mean specific force is {:.0f} deg off the body's -z; check "
                    "'body' in the map",
                    file, lean));
  }
  return found;
}

}  // namespace trueline
