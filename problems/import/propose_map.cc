#include <fmt/ranges.h>

#include <algorithm>

#include "problems/import/find_map.h"
#include "problems/import/formats/csv_table.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/propose_streams.h"

namespace trueline {
namespace {

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
