#include "problems/import/import_map.h"

#include <fnmatch.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/read_fixes_from_mocap.h"
#include "problems/import/read_streams_map.h"
#include "problems/log/log_yaml.h"

namespace trueline {
namespace {

CsvSeparators ReadSeparators(const YamlMap& map) {
  const std::string name = map.GetChoice("delimiter", {",", ";", "tab", "space", "|"}, ",");
  CsvSeparators separators;
  separators.delimiter = name == "tab" ? '\t' : name == "space" ? ' ' : name[0];
  separators.decimal_comma = map.GetChoice("decimal", {".", ","}, ".") == ",";
  if (separators.decimal_comma && separators.delimiter == ',') {
    map.Fail("decimal", "a comma can't be the delimiter, too; state 'delimiter'");
  }
  return separators;
}

// `format: ulog`, or a list of them.
std::vector<std::string> ReadFormats(const YamlMap& map) {
  const YAML::Node node = map.RawNode("format");
  if (!map.Has("format")) return {};
  const auto formats = node.IsSequence() ? map.Get<std::vector<std::string>>("format")
                                         : std::vector{map.Get<std::string>("format")};
  for (const std::string& format : formats) {
    if (IsFormat(format)) continue;
    map.Fail("format", fmt::format("'{}' is not known; use one of: {}", format, KnownFormats()));
  }
  const bool csv = std::find(formats.begin(), formats.end(), kCsvFormat) != formats.end();
  if (csv && formats.size() > 1) map.Fail("format", "a map of CSV fits no other format");
  return csv ? std::vector<std::string>() : formats;
}

InputMap ReadInput(const std::string& name, const YamlMap& map) {
  InputMap input;
  input.name = name;
  input.dialect.separators = ReadSeparators(map);
  input.dialect.skip_lines = map.Get<int>("skip_lines", 0);
  if (input.dialect.skip_lines < 0) map.Fail("skip_lines", "must not be negative");
  input.dialect.header = map.Get<bool>("header", true);
  input.dialect.units_line = map.Get<bool>("units_line", false);
  if (input.dialect.units_line && !input.dialect.header) map.Fail("units_line", "needs a header");
  input.formats = ReadFormats(map);
  const bool is_csv = input.formats.empty();
  input.time.of_row = !is_csv && !map.Has("time");
  if (!input.time.of_row) input.time = ReadTimeSource(map.Child("time"), is_csv);
  input.unsorted = ReadUnsorted(map, is_csv ? Unsorted::kRefuse : Unsorted::kSort);
  map.Finish();
  return input;
}

CutOptions ReadCut(const YamlMap& map) {
  CutOptions cut;
  cut.from = map.GetOptional<double>("from");
  cut.to = map.GetOptional<double>("to");
  if (cut.from && cut.to && !(*cut.from < *cut.to)) map.Fail("to", "must come after 'from'");
  cut.relative_to_start = map.GetChoice("relative_to", {"start", "clock"}, "start") == "start";
  if (map.Has("airborne")) {
    const YamlMap airborne = map.Child("airborne");
    cut.min_height = airborne.Get<double>("min_height");
    cut.margin = airborne.Get<double>("margin", 0.0);
    airborne.Finish();
  }
  map.Finish();
  return cut;
}

void ReadInputs(const YamlMap& map, ImportMap* import) {
  const YamlMap inputs = map.Child("inputs");
  for (const std::string& name : inputs.Keys()) {
    import->inputs.push_back(ReadInput(name, inputs.Child(name)));
  }
  if (import->inputs.empty()) map.Fail("inputs", "needs at least one input");
}

ImportMap ReadMap(const YamlMap& map) {
  ImportMap import;
  import.file = map.file();
  import.name = map.Get<std::string>("name", "{stem}");
  import.dataset = map.Get<std::string>("dataset", "");
  import.gravity = map.Get<double>("gravity", 9.81);
  if (!(import.gravity > 0.0)) map.Fail("gravity", "must be positive (m/s^2)");
  import.environment = ReadEnvironment(map);
  import.mocap_on_imu_clock = map.GetChoice("mocap_clock", {"own", "imu"}, "own") == "imu";
  ReadInputs(map, &import);
  import.streams = ReadStreamsMap(map.Child("streams"), ReadAxes(map, {}), import.inputs);
  import.cut = ReadCut(map.ChildOrEmpty("cut"));
  import.gates = ReadGates(map);
  if (map.Has("vehicle")) import.vehicle = ReadVehicle(map.Child("vehicle"));
  if (map.Has("fixes_from_mocap")) {
    import.fixes_from_mocap = ReadFixesFromMocap(map.Child("fixes_from_mocap"));
    if (!import.streams.contains("mocap"))
      map.Fail("fixes_from_mocap", "needs the stream 'mocap'; add it");
    if (import.streams.contains("fixes")) {
      map.Fail("fixes_from_mocap", "the map has the stream 'fixes'; keep one");
    }
  }
  map.Finish();
  return import;
}

}  // namespace

bool Fits(const std::string& pattern, const std::string& path) {
  return fnmatch(pattern.c_str(), std::filesystem::path(path).filename().c_str(), 0) == 0;
}

std::optional<Eigen::Vector3d> Series::At(TimeNs time) const {
  constexpr double kFarApart = 0.25;  // s
  const auto after = std::lower_bound(t.begin(), t.end(), time);
  if (after == t.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(after - t.begin());
  if (*after == time) return values[i];
  const double gap = i == 0 ? 1.0 : SecondsBetween(t[i - 1], t[i]);
  if (i == 0 || gap > kFarApart) return std::nullopt;
  return values[i - 1] + SecondsBetween(t[i - 1], time) / gap * (values[i] - values[i - 1]);
}

ImportMap ReadImportMap(const std::filesystem::path& path) {
  return ReadMap(YamlMap::FromFile(path));
}

ImportMap ReadImportMapText(const std::string& text, const std::string& name) {
  return ReadMap(YamlMap(YAML::Load(text), name, ""));
}

}  // namespace trueline
