#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>

#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/log/csv_text.h"
#include "problems/log/units.h"

namespace trueline {
namespace {

struct Spelling {
  std::string_view text, unit;
};

// How names spell units, in lower case.
constexpr auto kSpellings = std::to_array<Spelling>({
    {"m/s^2", "m/s^2"},
    {"m/s2", "m/s^2"},
    {"m/s/s", "m/s^2"},
    {"m s^-2", "m/s^2"},
    {"mps2", "m/s^2"},
    {"m_s2", "m/s^2"},
    {"g", "g"},
    {"rad/s", "rad/s"},
    {"rad s^-1", "rad/s"},
    {"rad_s", "rad/s"},
    {"radps", "rad/s"},
    {"deg/s", "deg/s"},
    {"deg s^-1", "deg/s"},
    {"deg_s", "deg/s"},
    {"dps", "deg/s"},
    {"m", "m"},
    {"cm", "cm"},
    {"mm", "mm"},
});

// "Acc X [g]", "acc_x_g" and "acc x (g)" as a name and a unit; none for "q[0]".
struct NameAndUnit {
  std::string name;  // in lower case
  std::string_view unit;
};

NameAndUnit SplitUnit(const ChannelField& field) {
  const std::string name = LowerCase(field.name);
  for (const auto& [text, unit] : kSpellings) {
    if (field.unit == text) return {name, unit};
    for (const std::string& end :
         {fmt::format("[{}]", text), fmt::format("({})", text), fmt::format("_{}", text)}) {
      if (!name.ends_with(end) || name.size() == end.size()) continue;
      return {std::string(TrimmedField(name.substr(0, name.size() - end.size()))), unit};
    }
  }
  return {name, ""};
}

// Fields of a channel that differ only in their last part: x, y, z or [0], [1], [2].
struct FieldGroup {
  std::string stem;                          // in lower case
  std::string_view unit;                     // of the first; empty if no name states it
  std::map<std::string, std::string> parts;  // field by last part
};

std::vector<FieldGroup> GroupsOf(const Channel& channel) {
  std::vector<FieldGroup> groups;
  for (const ChannelField& field : channel.fields) {
    const auto [name, unit] = SplitUnit(field);
    const std::size_t start = name.ends_with(']') ? name.rfind('[') : name.size() - 1;
    if (name.empty() || start == std::string::npos) continue;
    const std::string stem = name.substr(0, start), last = name.substr(start);
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const FieldGroup& g) { return g.stem == stem; });
    if (group == groups.end()) group = groups.insert(group, {stem, unit, {}});
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

// Three columns of a map, with their unit.
struct Vector {
  std::string text;         // empty for none
  bool states_unit = true;  // else the SI unit is a guess
};

Vector VectorFrom(const FieldGroup& group, const std::vector<std::string>& fields,
                  std::string_view si) {
  const bool stated = UnitFactor(si, group.unit).has_value();
  return {fmt::format("columns: [{}], unit: {}", fmt::join(fields, ", "), stated ? group.unit : si),
          stated};
}

// The first vector whose name has one of the words.
Vector VectorOf(const std::vector<FieldGroup>& groups, const std::vector<std::string>& words,
                std::string_view si) {
  for (const FieldGroup& group : groups) {
    const std::vector<std::string> three = ThreeOf(group);
    if (three.empty() || group.parts.contains("w") || !Mentions(group.stem, words)) continue;
    if (Mentions(group.stem, {"cov", "bias", "offset"})) continue;
    return VectorFrom(group, three, si);
  }
  return {};
}

// The vector of short names, such as ax, ay, az.
Vector ShortVectorOf(const std::vector<FieldGroup>& groups, const std::vector<std::string>& stems,
                     std::string_view si) {
  for (const std::string& stem : stems) {
    for (const FieldGroup& group : groups) {
      const std::vector<std::string> three = ThreeOf(group);
      if (group.stem == stem && !three.empty()) return VectorFrom(group, three, si);
    }
  }
  return {};
}

Vector AccelerometerOf(const std::vector<FieldGroup>& groups) {
  const Vector named = VectorOf(groups, {"acc", "a_rs"}, "m/s^2");
  return named.text.empty() ? ShortVectorOf(groups, {"a", "a_", "f", "f_"}, "m/s^2") : named;
}

Vector GyroscopeOf(const std::vector<FieldGroup>& groups) {
  const Vector named = VectorOf(groups, {"gyr", "angular_vel", "omega", "w_rs"}, "rad/s");
  if (!named.text.empty()) return named;
  const Vector short_name = ShortVectorOf(groups, {"g", "g_", "w", "w_"}, "rad/s");
  if (!short_name.text.empty()) return short_name;
  for (const FieldGroup& group : groups) {
    const std::vector<std::string> rates = PartsOf(group, {"p", "q", "r"});
    if (group.stem.empty() && !rates.empty()) return VectorFrom(group, rates, "rad/s");
  }
  return {};
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
  const Vector accel = AccelerometerOf(groups);
  const Vector gyro = GyroscopeOf(groups);
  if (!accel.text.empty() && !gyro.text.empty()) {
    const bool stated = accel.states_unit && gyro.states_unit;
    lines->try_emplace("imu", fmt::format("imu: {{{}accel: {{{}}}, gyro: {{{}}}}}{}", from,
                                          accel.text, gyro.text, stated ? "" : "  # or g, deg/s"));
  }
  const std::string q = QuaternionOf(groups);
  const Vector p = VectorOf(groups, {"pos", "transl", "p_rs", "point"}, "m");
  if (!q.empty() && !p.text.empty()) {
    lines->try_emplace(
        "mocap", fmt::format("mocap: {{{}position: {{{}}}, {}}}  # if truth", from, p.text, q));
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
  const int skip = layout.skip_lines + (layout.header && !named ? 1 : 0);
  const std::string header =
      (skip > 0 ? fmt::format(", skip_lines: {}", skip) : "") + (named ? "" : ", header: false");
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
