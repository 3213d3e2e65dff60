#include "problems/import/read_streams_map.h"

#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

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
        is_velocity,
        {},
        nullptr};
    if (map.Has("input")) source.input = OtherInput(map);
    if (field.axes == FrameAxes::kBody && !map.Has("attitude")) source.axes = own.body;
    if (field.axes == FrameAxes::kBody && map.Has("attitude")) {
      const YamlMap attitude = map.Child("attitude");
      source.attitude = SourceAttitude(attitude, own);
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
