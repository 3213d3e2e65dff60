#include "problems/import/find_map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/units.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/propose_streams.h"
#include "problems/log/imu_health.h"
#include "problems/log/native_log.h"

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
  return layout.header && layout.warning.empty() && input.dialect == layout;
}

bool IsFor(const ImportMap& map, const Recording& recording) {
  if (map.inputs.size() != 1) return false;
  const std::vector<std::string>& formats = map.inputs.front().formats;
  if (recording.format().key == std::string(kCsvFormat)) {
    return formats.empty() && ReadsNamesOf(map.inputs.front(), recording);
  }
  return std::find(formats.begin(), formats.end(), recording.format().key) != formats.end();
}

// Whether the map of a single table can name its columns and its time.
bool ReadsAsCsv(const CsvLayout& layout) {
  return !layout.has_made_names && !(layout.time && layout.time->nanoseconds);
}

Eigen::Vector3d MeanForce(const FlightLog& log) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : log.imu) sum += sample.accel;
  return sum / static_cast<double>(log.imu.size());
}

// What any flight feels on average, within a factor of 3 of gravity: else the unit is another one.
void RequireForceOfFlight(const FlightLog& log, const std::string& file) {
  double sum = 0.0;
  for (const ImuSample& sample : log.imu) sum += sample.accel.norm();
  const double mean = sum / static_cast<double>(log.imu.size());
  if (mean > log.gravity / 3.0 && mean < log.gravity * 3.0) return;
  throw NoUsableLog(fmt::format(
      "{}: the accelerometer reads {:.3g} m/s^2 on average, where every flight has about {:.3g}; "
      "state its 'unit' in a map",
      file, mean, log.gravity));
}

// What a map makes of these files; none if that is no usable log.
std::optional<FlightLog> Tried(const FoundLog& found) {
  try {
    FlightLog log = ConvertLog(MapOf(found), found.files, {});
    Shortcomings(log, found.files.front());
    return log;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

bool HasAttitude(const FlightLog& log) { return !log.attitude.empty() || !log.mocap.empty(); }

// Names alone may suit a map that ships while its units or topics do not, or while it reads less
// than the names show: then what the numbers propose is read, if it can be.
void PreferWhatIsUsable(FoundLog* found) {
  if (!found->shipped || !AreTables(*found)) return;
  const std::optional<FlightLog> by_shipped = Tried(*found);
  if (by_shipped && HasAttitude(*by_shipped)) return;
  FoundLog proposed{found->files, nullptr, std::nullopt, ProposeMap(found->recording.get()), {}};
  proposed.recording = std::move(found->recording);
  const std::optional<FlightLog> by_names = Tried(proposed);
  if (by_names && (!by_shipped || HasAttitude(*by_names))) {
    proposed.assumed = AssumptionsOf(YAML::Load(proposed.map));
    *found = std::move(proposed);
  } else {
    found->recording = std::move(proposed.recording);
  }
}

// A map that ships reads its own columns only: those of a tracker beside them are mocap, and the
// attitude where there is no other.
void AddTracker(FoundLog* found) {
  if (!found->shipped || !AreTables(*found) || found->shipped->streams.contains("mocap")) return;
  const std::string line = ProposeTracker(found->recording.get());
  if (line.empty()) return;
  YAML::Node map = YAML::Load(found->map);
  YAML::Node mocap = YAML::Load(line)["mocap"], attitude = YAML::Clone(mocap);
  attitude.remove("position");
  map["streams"]["mocap"] = mocap;
  YAML::Node own = map["streams"]["attitude"];
  if (!own) map["streams"]["attitude"] = attitude;
  if (own && own.IsSequence()) own.push_back(attitude);  // the first counts that the log has
  found->map = YAML::Dump(map);
  found->assumed = {
      fmt::format("by {}, and by the names of further columns {}", found->shipped->file, line)};
  found->shipped.reset();
}

// Of the mean specific force from the body's -z, deg.
double LeanOf(const FlightLog& log) {
  const Eigen::Vector3d force = MeanForce(log);
  return std::acos(std::clamp(-force.z() / force.norm(), -1.0, 1.0)) / kDegree;
}

// Commas between logs mean several flights.
std::string OtherFiles(const std::string& file) {
  const std::vector<std::string> files = SplitPaths(file);
  if (!std::all_of(files.begin(), files.end(), IsTable)) return "";
  return fmt::format(
      "; if another file of this flight has it: trueline convert --in={},OTHER --out=LOG", file);
}

const char* UnitOfExponent(int exponent) {
  return exponent == 9                ? "s"
         : exponent == 6              ? "ms"
         : exponent == 3              ? "us"
         : exponent == kTicksExponent ? "ticks"
                                      : "ns";
}

std::string CsvInput(const Recording& recording) {
  const CsvLayout layout = GuessCsvLayout(recording.file());
  const auto [separator, decimal_comma] = layout.separators;
  const std::string delimiter = separator == '\t'  ? "tab"
                                : separator == ' ' ? "space"
                                                   : std::string(1, separator);
  // Names that fit no column are a line to skip.
  const bool named = layout.header && layout.warning.empty();
  const int skip =
      layout.skip_lines + (layout.header && !named ? 1 : 0) + (layout.units_line && !named ? 1 : 0);
  const std::string header = (skip > 0 ? fmt::format(", skip_lines: {}", skip) : "") +
                             (named ? "" : ", header: false") +
                             (named && layout.units_line ? ", units_line: true" : "");
  const std::string time = layout.time ? layout.columns[layout.time->column] : "t";
  const double frame = layout.time ? layout.time->frame : 0.0;
  return fmt::format(
      "{{delimiter: \"{}\"{}{}, time: {{column: \"{}\", unit: {}{}}}, unsorted: sort}}  # {}",
      delimiter, decimal_comma ? ", decimal: \",\"" : "", header, time,
      UnitOfExponent(layout.time ? layout.time->exponent : 9),
      frame > 0.0 ? fmt::format(", scale: {0}, offset: -{0}", frame) : "",
      frame > 0.0                            ? "frames by the rate that the head states"
      : layout.time && layout.time->is_named ? "check the unit: s, ms, us or ns"
      : layout.time                          ? "the first column that rises; check it and its unit"
                    : "no column rises as time does; give its name or number");
}

// A map without a stream is still a mapping.
std::string StreamsText(std::map<std::string, std::string> lines) {
  const std::string text = lines.empty() ? "streams: {}\n" : "streams:\n";
  lines.try_emplace("imu", "# imu: none was found by the names; it is needed");
  std::string streams;
  for (const auto& [stream, line] : lines) streams += "  " + line + "\n";
  return text + streams;
}

}  // namespace

bool HasOtherUp(const FlightLog& log) { return !(LeanOf(log) < kMaxLean); }

bool HasCommandsAlone(const FlightLog& log) { return log.imu.empty() && !log.motors.empty(); }

bool AreTables(const FoundLog& found) {
  return std::all_of(found.files.begin(), found.files.end(), IsTable);
}

std::vector<std::string> AssumptionsOf(const YAML::Node& map) {
  std::vector<std::string> lines;
  const auto line = [](const std::string& key, const YAML::Node& value) {
    YAML::Emitter emitter;
    emitter << YAML::Flow << value;
    return fmt::format("{}: {}", key, emitter.c_str());
  };
  for (const char* part : {"inputs", "streams"}) {
    for (const auto& entry : map[part]) {
      lines.push_back(line(entry.first.Scalar(), entry.second));
    }
  }
  lines.push_back(fmt::format("{}, {}", line("earth", map["earth"]), line("body", map["body"])));
  return lines;
}

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

FoundLog FindLog(const std::vector<std::string>& files) {
  if (files.empty()) throw InputError("no log is given");
  FoundLog found{files, nullptr, std::nullopt, "", {}};
  std::error_code unknown;
  for (const std::string& file : files) {  // the errors of what is no log to convert
    const bool is_native = std::filesystem::exists(file + "/log.yaml", unknown);
    if (is_native || !std::filesystem::exists(file, unknown)) OpenRecording(file);
  }
  const std::vector<std::string> tables = TablesIn(files);
  const std::string key = files.size() == 1 ? FormatOf(files.front()) : "";
  const bool is_recording = !key.empty() && key != kCsvFormat;
  if (is_recording || (files.size() == 1 && tables == files && key.empty())) {
    found.recording = OpenRecording(files.front());
    found.shipped = FindShippedMap(*found.recording);
  } else {
    for (const std::string& table : tables) {
      if (IsTable(table)) continue;
      throw InputError(table +
                       ": is no table of text, where several files are given; give one "
                       "recording, or a --map with several inputs");
    }
    if (tables.size() == 1) {
      found.recording = OpenRecording(tables.front());
      found.shipped = FindShippedMap(*found.recording);
    }
    std::unique_ptr<Recording> all = found.shipped ? nullptr : OpenTables(tables);
    if (all) {
      const bool is_known = all->format().key != std::string_view(kTablesFormat);
      const auto map = is_known ? FindShippedMap(*all) : std::nullopt;
      // A single table that ForeignCsv can read has a map that says more of it.
      const bool is_plain = found.recording && all->channels().size() == 1 &&
                            ReadsAsCsv(GuessCsvLayout(tables.front()));
      if (map || !is_plain) {
        found.recording = std::move(all);
        found.shipped = map;
        found.files = tables;
      }
    }
  }
  found.map =
      found.shipped ? FirstBytes(found.shipped->file, 1 << 20) : ProposeMap(found.recording.get());
  if (!found.shipped) found.assumed = AssumptionsOf(YAML::Load(found.map));
  AddTracker(&found);
  PreferWhatIsUsable(&found);
  return found;
}

ImportMap MapOf(const FoundLog& found) {
  if (found.shipped) return *found.shipped;
  const std::string file = found.recording->file();
  const bool has_imu = static_cast<bool>(YAML::Load(found.map)["streams"]["imu"]);
  if (AreTables(found) && (!has_imu || found.files.size() == 1)) {
    for (const std::string& table : found.files) {
      const CsvLayout layout = GuessCsvLayout(table);
      if (!layout.time_problem.empty()) throw NoUsableLog(table + ": " + layout.time_problem);
    }
  }
  if (!has_imu) throw NoUsableLog(file + ": " + WhyNoMapFits(found.recording.get()));
  ImportMap map = ReadImportMapText(found.map, "proposed_map.yaml");
  if (map.streams.contains("fixes") || map.streams.contains("mocap")) return map;
  throw NoUsableLog(file +
                    ": no column has the name of a position, or of a velocity in the "
                    "earth's axes; log one" +
                    OtherFiles(file));
}

std::vector<std::string> AssumptionWarnings(const FoundLog& found) {
  if (found.assumed.empty() || found.shipped) return found.assumed;
  std::vector<std::string> warnings = {
      fmt::format("{}: no map is known for it. The names and numbers of its columns say what "
                  "follows; check it, and correct proposed_map.yaml where it is wrong",
                  found.recording->file())};
  warnings.insert(warnings.end(), found.assumed.begin(), found.assumed.end());
  return warnings;
}

FlightLog ConvertFound(const FoundLog& found, const ConvertOptions& options) {
  const ImportMap map = MapOf(found);
  if (found.shipped) return ConvertLog(map, found.files, options);
  try {
    return ConvertLog(map, found.files, options);
  } catch (const NoUsableLog&) {
    throw;
  } catch (const InputError& error) {
    throw NoUsableLog(std::string("by the proposed map: ") + error.what());
  }
}

ImportMap ReadUserMap(const std::string& path, const std::vector<std::string>& files,
                      std::vector<std::string>* warnings, YAML::Node* node) {
  const ImportMap map = ReadImportMap(path);
  *node = YAML::LoadFile(path);
  const auto has = [&](const char* stream) { return map.streams.contains(stream); };
  if (has("fixes") || has("mocap") || has("pose") || files.size() != 1) return map;
  if (map.inputs.size() != 1 || !map.inputs.front().formats.empty()) return map;
  const std::map<std::string, std::string> lines =
      ProposeStreams(OpenRecording(files.front()).get()).lines;
  const auto fixes = lines.find("fixes");
  if (fixes == lines.end()) return map;
  (*node)["streams"]["fixes"] = YAML::Load(fixes->second)["fixes"];
  ImportMap with_fixes = ReadImportMapText(YAML::Dump(*node), path);
  warnings->push_back(
      fmt::format("{}: reads no position; by the names of the columns this is "
                  "added to 'streams': {}",
                  path, fixes->second));
  return with_fixes;
}

std::string NoPositions(const std::string& file) {
  return file +
         ": has no position: neither GNSS nor vision nor mocap; log one of them, or give a "
         "trajectory as a second input of a map" +
         OtherFiles(file);
}

std::vector<std::string> Shortcomings(const FlightLog& log, const std::string& file) {
  std::vector<std::string> found;
  if (HasCommandsAlone(log))
    return {file + ": has no IMU; only trueline diagnose --against reads it"};
  if (log.imu.size() < kLeastImuSamples) {
    throw NoUsableLog(fmt::format(
        "{}: the IMU has only {} samples, too few for a flight; log it at 100 Hz or more", file,
        log.imu.size()));
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
  RequireForceOfFlight(log, file);
  if (!HasPositions(log) && ReadsWithoutPositions(log)) {
    found.push_back(NoPositions(file) + kWithoutPositions);
  } else if (log.fixes.empty() && log.mocap.empty()) {
    throw NoUsableLog(NoPositions(file));
  }
  if (HasOtherUp(log)) {
    found.push_back(
        fmt::format("{}: the mean specific force is {:.0f} deg off the body's -z; check "
                    "'body' in the map",
                    file, LeanOf(log)));
  }
  return found;
}

std::string ProposeMap(Recording* recording) {
  const bool is_csv = recording->format().key == std::string(kCsvFormat);
  const ProposedStreams streams = ProposeStreams(recording);
  const char* axes = streams.is_z_up ? "earth: ENU  # or NWU, NED\n"
                                       "body: FLU   # z reads about +1 g in the mean\n"
                                     : "earth: NED  # or ENU, NWU\n"
                                       "body: FRD   # or FLU: at rest z reads +9.81\n";
  return fmt::format(
      "# Proposed from the names in {}. Check frames, units and streams.\n"
      "# config/import/nanobench.yaml explains the keys, px4.yaml those of recordings.\n"
      "name: \"{{stem}}\"\n"
      "inputs:\n"
      "  log: {}\n"
      "{}{}",
      recording->file(),
      is_csv ? CsvInput(*recording) : fmt::format("{{format: {}}}", recording->format().key), axes,
      StreamsText(streams.lines));
}

std::string WhyNoMapFits(Recording* recording) {
  const std::vector<Channel>& channels = recording->channels();
  const bool any = std::any_of(channels.begin(), channels.end(),
                               [](const Channel& channel) { return channel.count > 0; });
  if (!any) return "has no records";
  const ProposedStreams found = ProposeStreams(recording);
  if (found.lines.contains("imu")) {
    return "no map in config/import fits it, though the names of its fields show an IMU";
  }
  if (recording->format().key == std::string("tum")) {
    return "is a trajectory without an IMU; give it as the second input of a map, as "
           "config/import/imu_and_tum.yaml does";
  }
  constexpr std::size_t kMostNamed = 40;  // fields
  const auto shown = [](const char* what, const std::vector<ProposedVector>& vectors) {
    return vectors.empty() ? std::string()
                           : fmt::format("{} {}; ", what, fmt::join(vectors.front().columns, ", "));
  };
  std::string fields;
  std::size_t named = 0;
  for (const Channel& channel : channels) {
    for (const ChannelField& field : channel.fields) {
      if (named++ < kMostNamed) fields += (fields.empty() ? "" : ", ") + field.name;
    }
  }
  if (fields.empty()) {
    return "has no accelerometer and gyroscope, which are needed: none of its messages has a "
           "number "
           "that can be read";
  }
  return fmt::format(
      "has no {} by the names of its fields, which is needed. {}{}its fields are {}. Name three of "
      "them as acc_x [m/s^2] or gyro_x [rad/s], or state them in a --map: streams: {{imu: {{accel: "
      "{{columns: [A, B, C], unit: m/s^2}}, gyro: {{columns: [D, E, F], unit: rad/s}}}}}}",
      !found.accels.empty() ? "gyroscope"
      : found.gyros.empty() ? "accelerometer and gyroscope"
                            : "accelerometer",
      shown("The accelerometer is", found.accels), shown("The gyroscope is", found.gyros), fields);
}

}  // namespace trueline
