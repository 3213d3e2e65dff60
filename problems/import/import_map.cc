#include "problems/import/import_map.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/import/formats/open_recording.h"
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

// s, of a clock's shift: such that stamps stay within 64 bits.
double OffsetOf(const YamlMap& map, const std::string& key) {
  const auto offset = map.Get<double>(key);
  if (!(std::abs(offset) < 9e9))
    map.Fail(key, "is beyond the 9e9 s that a log can hold; it is in s");
  return offset;
}

void ReadOffset(const YamlMap& map, TimeSource* time) {
  const YAML::Node node = map.RawNode("offset");
  if (!map.Has("offset")) return;
  if (!node.IsMap()) {
    time->offset_by_file.emplace_back("*", OffsetOf(map, "offset"));
    return;
  }
  const YamlMap by_file = map.Child("offset");
  for (const std::string& pattern : by_file.Keys()) {
    time->offset_by_file.emplace_back(pattern, OffsetOf(by_file, pattern));
  }
}

std::size_t ReadInputName(const YamlMap& map, const std::vector<InputMap>& inputs) {
  std::vector<std::string> names;
  names.reserve(inputs.size());
  for (const InputMap& input : inputs) names.push_back(input.name);
  const std::string name = map.GetChoice("input", names, names.front());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
  }
  return 0;
}

// `channel` or `type`, and what goes with them: of streams of a recording.
void ReadChannel(const YamlMap& map, const InputMap& input, StreamMap* stream) {
  if (input.formats.empty()) return;
  const YAML::Node node = map.RawNode("channel");
  if (map.Has("channel")) {
    stream->channels = node.IsSequence() ? map.Get<std::vector<std::string>>("channel")
                                         : std::vector{map.Get<std::string>("channel")};
  }
  stream->type = map.Get<std::string>("type", "");
  stream->prefer = map.Get<std::vector<std::string>>("prefer", {});
  stream->avoid = map.Get<std::vector<std::string>>("avoid", {});
  stream->with = map.Get<std::vector<std::string>>("with", {});
  stream->optional = map.Get<bool>("optional", false);
  if (stream->channels.empty() == stream->type.empty()) {
    map.Fail("channel", "give either 'channel' or 'type'; --in without --map lists them");
  }
}

// The settings that all streams share.
StreamMap ReadSettings(const YamlMap& map, const std::vector<InputMap>& inputs) {
  StreamMap stream;
  stream.input = ReadInputName(map, inputs);
  const InputMap& input = inputs[stream.input];
  stream.time =
      map.Has("time") ? ReadTimeSource(map.Child("time"), input.formats.empty()) : input.time;
  if (map.Has("time") && !map.Child("time").Has("offset")) {
    stream.time.offset_by_file = inputs[stream.input].time.offset_by_file;
  }
  stream.unsorted = ReadUnsorted(map, inputs[stream.input].unsorted);
  stream.skip_missing = map.Get<bool>("skip_missing", false);
  stream.filter = RowFilter(map);
  stream.leave_out = map.Get<std::vector<std::array<double, 2>>>("leave_out", {});
  ReadChannel(map, inputs[stream.input], &stream);
  return stream;
}

// A native log with such a sigma can't be read back.
void RequireSigma(const YamlMap& map, const NumberSource& numbers) {
  const std::optional<double> constant = numbers.Constant();
  if (!constant || *constant >= kLeastSigma) return;
  map.Fail("constant", fmt::format("found {}; a standard deviation must be positive, {} m or more",
                                   *constant, kLeastSigma));
}

// Archive that reads the source of each field from the stream's part of a map.
class SourceReader {
 public:
  SourceReader(const YamlMap& map, const SourceAxes& axes, const std::vector<InputMap>& inputs,
               std::vector<FieldSource>* sources)
      : map_(map), axes_(axes), inputs_(inputs), sources_(sources) {}

  // A vector may have axes of its own beside those of the stream's attitude.
  void operator()(const Field& field, const Eigen::Vector3d&) const {
    const bool is_earth = field.axes == FrameAxes::kEarth;
    const bool is_velocity = is_earth && !map_.Has(field.key) && map_.Has("velocity");
    const YamlMap map = map_.Child(is_velocity ? "velocity" : field.key);
    const SourceAxes own = ReadAxes(map, ReadAxes(map_, axes_));
    const bool geodetic = is_earth && !is_velocity && map.Has("geodetic");
    FieldSource source{
        field.key,
        NumberSource(map, is_velocity ? "m/s" : field.unit, 3, geodetic ? "geodetic" : "columns"),
        {},
        own.earth,
        geodetic,
        is_velocity};
    if (map.Has("input")) source.input = OtherInput(map);
    if (field.axes == FrameAxes::kBody && !map.Has("attitude")) source.axes = own.body;
    if (field.axes == FrameAxes::kBody && map.Has("attitude")) {
      const YamlMap attitude = map.Child("attitude");
      source.attitude = SourceAttitude(attitude, own);
      source.in_earth = map.GetChoice("axes", {"earth", "body"}, "earth") == "earth";
      source.without_gravity = map.GetChoice("gravity", {"kept", "removed"}, "kept") == "removed";
      if (!source.in_earth) source.axes = own.body;
      attitude.Finish();
    }
    map.Finish();
    sources_->push_back(source);
  }
  void operator()(const Field& field, const Eigen::Quaterniond&) const {
    sources_->push_back({field.key, {}, SourceAttitude(map_, axes_)});
  }
  void operator()(const Field& field, double) const {
    if (*field.key == '\0') return Add(field, NumberSource::Single(map_, field.unit));
    const YamlMap map = map_.Child(field.key);
    const NumberSource numbers = NumberSource::Single(map, field.unit);
    if (field.is_sigma) RequireSigma(map, numbers);
    Add(field, numbers);
  }
  void operator()(const Field& field, int) const {
    Add(field, map_.Has(field.key) ? NumberSource::Single(map_.Child(field.key), field.unit)
                                   : NumberSource(0.0));
  }
  void operator()(const Field& field, const std::vector<double>&) const {
    Add(field, NumberSource(map_, field.unit, 0));
  }

 private:
  void Add(const Field& field, const NumberSource& numbers) const {
    sources_->push_back({field.key, numbers, {}});
  }
  std::size_t OtherInput(const YamlMap& map) const {
    const std::size_t input = ReadInputName(map, inputs_);
    if (inputs_[input].formats.empty()) return input;
    map.Fail("input", "is no CSV; channels of recordings are joined by 'with' of the stream");
  }

  const YamlMap& map_;
  const SourceAxes& axes_;
  const std::vector<InputMap>& inputs_;
  std::vector<FieldSource>* sources_;
};

}  // namespace

bool Fits(const std::string& pattern, const std::string& path) {
  return fnmatch(pattern.c_str(), std::filesystem::path(path).filename().c_str(), 0) == 0;
}

std::vector<StreamMap> StreamMap::Alternatives() const {
  std::vector<StreamMap> all = {*this};
  all.insert(all.end(), otherwise.begin(), otherwise.end());
  return all;
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

Unsorted ReadUnsorted(const YamlMap& map, Unsorted fallback) {
  if (!map.Has("unsorted")) return fallback;
  const std::string name = map.GetChoice("unsorted", {"refuse", "drop", "sort"}, "");
  return name == "drop" ? Unsorted::kDrop : name == "sort" ? Unsorted::kSort : Unsorted::kRefuse;
}

TimeSource ReadTimeSource(const YamlMap& map, bool is_csv) {
  TimeSource time;
  time.of_row = !is_csv && !map.Has("column");
  if (time.of_row) {
    ReadOffset(map, &time);
    map.Finish();
    return time;
  }
  map.Get<std::string>("column");
  time.column = SourceColumn(map.RawNode("column"), map.file());
  const double unit = ReadUnit(map, "s");
  time.exponent = TimeExponent(unit);
  const auto scale = map.GetOptional<double>("scale");
  if (scale && !(*scale > 0.0)) map.Fail("scale", "must be positive");
  if (scale) time.factor = *scale * unit;
  ReadOffset(map, &time);
  map.Finish();
  return time;
}

std::map<std::string, StreamMap> ReadStreamsMap(const YamlMap& map, const SourceAxes& axes,
                                                const std::vector<InputMap>& inputs) {
  std::map<std::string, StreamMap> streams;
  // Required, but for logs of commands: the error if absent.
  if (!map.Has("imu") && !map.Has("motors")) map.Child("imu");
  const FlightLog log;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    const YAML::Node node = map.RawNode(stream.name);  // marks it as known, though absent
    if (!map.Has(stream.name)) return;
    const auto read = [&](const YamlMap& child) {
      StreamMap one = ReadSettings(child, inputs);
      SourceReader reader(child, axes, inputs, &one.fields);
      const SampleOf<decltype(samples)> sample{};
      sample.Describe(reader, sample, stream);
      child.Finish();
      return one;
    };
    if (!node.IsSequence()) {
      streams[stream.name] = read(map.Child(stream.name));
      return;
    }
    std::vector<StreamMap> all;
    for (const YamlMap& child : map.Children(stream.name)) all.push_back(read(child));
    if (all.empty() || all.front().channels.empty() == all.front().type.empty()) {
      map.Fail(stream.name, "a list needs at least one stream, each of a recording");
    }
    streams[stream.name] = all.front();
    streams[stream.name].otherwise.assign(all.begin() + 1, all.end());
  });
  map.Finish();
  return streams;
}

}  // namespace trueline
