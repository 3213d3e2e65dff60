#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

// Fields of a channel that differ only in their last part: x, y, z or [0], [1], [2].
struct FieldGroup {
  std::string stem;                          // in lower case
  std::map<std::string, std::string> parts;  // field by last part
};

std::vector<FieldGroup> GroupsOf(const Channel& channel) {
  std::vector<FieldGroup> groups;
  for (const ChannelField& field : channel.fields) {
    const std::string name = LowerCase(field.name);
    const std::size_t start = name.ends_with(']') ? name.rfind('[') : name.size() - 1;
    if (name.empty() || start == std::string::npos) continue;
    const std::string stem = name.substr(0, start), last = name.substr(start);
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const FieldGroup& g) { return g.stem == stem; });
    if (group == groups.end()) group = groups.insert(group, {stem, {}});
    group->parts[last] = field.name;
  }
  return groups;
}

// The fields of these last parts, quoted; empty if one is missing.
std::vector<std::string> PartsOf(const FieldGroup& group, const std::vector<std::string>& lasts) {
  std::vector<std::string> fields;
  for (const std::string& last : lasts) {
    const auto found = group.parts.find(last);
    if (found == group.parts.end()) return {};
    fields.push_back(fmt::format("\"{}\"", found->second));
  }
  return fields;
}

std::vector<std::string> ThreeOf(const FieldGroup& group) {
  const std::vector<std::string> xyz = PartsOf(group, {"x", "y", "z"});
  return xyz.empty() ? PartsOf(group, {"[0]", "[1]", "[2]"}) : xyz;
}

bool Mentions(const std::string& stem, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return stem.find(word) != std::string::npos; });
}

std::string ColumnsText(const std::vector<std::string>& fields) {
  return fmt::format("columns: [{}]", fmt::join(fields, ", "));
}

// The first vector whose name has one of the words.
std::string VectorOf(const std::vector<FieldGroup>& groups, const std::vector<std::string>& words) {
  for (const FieldGroup& group : groups) {
    const std::vector<std::string> three = ThreeOf(group);
    if (three.empty() || group.parts.contains("w") || !Mentions(group.stem, words)) continue;
    if (Mentions(group.stem, {"cov", "bias", "offset"})) continue;
    return ColumnsText(three);
  }
  return "";
}

// The vector of short names, such as ax, ay, az.
std::string ShortVectorOf(const std::vector<FieldGroup>& groups,
                          const std::vector<std::string>& stems) {
  for (const std::string& stem : stems) {
    for (const FieldGroup& group : groups) {
      const std::vector<std::string> three = ThreeOf(group);
      if (group.stem == stem && !three.empty()) return ColumnsText(three);
    }
  }
  return "";
}

std::string AccelerometerOf(const std::vector<FieldGroup>& groups) {
  std::string named = VectorOf(groups, {"acc", "a_rs"});
  return named.empty() ? ShortVectorOf(groups, {"a", "a_", "f", "f_"}) : named;
}

std::string GyroscopeOf(const std::vector<FieldGroup>& groups) {
  std::string named = VectorOf(groups, {"gyr", "angular_vel", "omega", "w_rs"});
  if (!named.empty()) return named;
  std::string short_name = ShortVectorOf(groups, {"g", "g_", "w", "w_"});
  if (!short_name.empty()) return short_name;
  for (const FieldGroup& group : groups) {
    const std::vector<std::string> rates = PartsOf(group, {"p", "q", "r"});
    if (group.stem.empty() && !rates.empty()) return ColumnsText(rates);
  }
  return "";
}

std::string QuaternionOf(const std::vector<FieldGroup>& groups) {
  for (const FieldGroup& group : groups) {
    const std::vector<std::string> q = PartsOf(group, {"w", "x", "y", "z"});
    if (q.empty()) continue;
    return fmt::format("quaternion: {{w: {}, x: {}, y: {}, z: {}}}", q[0], q[1], q[2], q[3]);
  }
  return "";
}

// One line for each stream that a channel's names suggest.
void ProposeStreams(const Channel& channel, bool is_csv,
                    std::map<std::string, std::string>* lines) {
  const std::vector<FieldGroup> groups = GroupsOf(channel);
  const std::string from = is_csv ? "" : fmt::format("channel: \"{}\", ", channel.Label());
  const std::string accel = AccelerometerOf(groups);
  const std::string gyro = GyroscopeOf(groups);
  if (!accel.empty() && !gyro.empty()) {
    lines->try_emplace("imu", fmt::format("imu: {{{}accel: {{{}, unit: m/s^2}}, gyro: {{{}, unit: "
                                          "rad/s}}}}  # or g, deg/s",
                                          from, accel, gyro));
  }
  const std::string q = QuaternionOf(groups);
  const std::string p = VectorOf(groups, {"pos", "transl", "p_rs", "point"});
  if (!q.empty() && !p.empty()) {
    lines->try_emplace(
        "mocap", fmt::format("mocap: {{{}position: {{{}, unit: m}}, {}}}  # if truth", from, p, q));
  } else if (!q.empty()) {
    lines->try_emplace("attitude", fmt::format("attitude: {{{}{}}}", from, q));
  }
  for (const ChannelField& field : channel.fields) {
    if (!LowerCase(field.name).starts_with("volt") && !LowerCase(field.name).starts_with("vbat"))
      continue;
    lines->try_emplace("battery",
                       fmt::format("battery: {{{}column: \"{}\", unit: V}}", from, field.name));
  }
}

const char* UnitOfExponent(int exponent) {
  return exponent == 9 ? "s" : exponent == 6 ? "ms" : exponent == 3 ? "us" : "ns";
}

std::string CsvInput(const Recording& recording) {
  const CsvLayout layout = GuessCsvLayout(recording.file());
  const auto [separator, decimal_comma] = layout.separators;
  const std::string delimiter = separator == '\t'  ? "tab"
                                : separator == ' ' ? "space"
                                                   : std::string(1, separator);
  // Names that fit no column are a line to skip.
  const bool named = layout.header && layout.warning.empty();
  const std::string header = named           ? ""
                             : layout.header ? ", skip_lines: 1, header: false"
                                             : ", header: false";
  const std::string time = layout.time_column ? layout.columns[*layout.time_column] : "t";
  return fmt::format("{{delimiter: \"{}\"{}{}, time: {{column: \"{}\", unit: {}}}}}  # {}",
                     delimiter, decimal_comma ? ", decimal: \",\"" : "", header, time,
                     UnitOfExponent(layout.time_exponent),
                     layout.time_column ? "check the unit: s, ms, us or ns"
                                        : "no name tells the time column; give it, or its number");
}

// One line for each stream that the names suggest, by stream.
std::map<std::string, std::string> ProposedStreams(const Recording& recording) {
  const bool is_csv = recording.format().key == std::string(kCsvFormat);
  std::map<std::string, std::string> lines;
  for (const Channel& channel : recording.channels()) {
    if (channel.count > 0) ProposeStreams(channel, is_csv, &lines);
  }
  return lines;
}

}  // namespace

std::string ProposeMap(const Recording& recording) {
  const bool is_csv = recording.format().key == std::string(kCsvFormat);
  std::map<std::string, std::string> lines = ProposedStreams(recording);
  lines.try_emplace("imu", "# imu: none was found by the names; it is needed");
  std::string text = fmt::format(
      "# Proposed from the names in {}. Check frames, units and streams.\n"
      "# config/import/nanobench.yaml explains the keys, px4.yaml those of recordings.\n"
      "name: \"{{stem}}\"\n"
      "inputs:\n"
      "  log: {}\n"
      "earth: NED  # or ENU, NWU\n"
      "body: FRD   # or FLU: at rest z reads +9.81\n"
      "streams:\n",
      recording.file(),
      is_csv ? CsvInput(recording) : fmt::format("{{format: {}}}", recording.format().key));
  for (const auto& [stream, line] : lines) text += "  " + line + "\n";
  return text;
}

std::string WhyNoMapFits(const Recording& recording) {
  const std::vector<Channel>& channels = recording.channels();
  const bool any = std::any_of(channels.begin(), channels.end(),
                               [](const Channel& channel) { return channel.count > 0; });
  if (!any) return "has no records";
  if (ProposedStreams(recording).contains("imu")) {
    return "no map in config/import fits it, though the names of its fields show an IMU";
  }
  if (recording.format().key == std::string("tum")) {
    return "is a trajectory without an IMU; give it as the second input of a map, as "
           "config/import/imu_and_tum.yaml does";
  }
  return "has no IMU by the names of its fields (accelerometer and gyroscope in one channel), "
         "which is needed";
}

}  // namespace trueline
