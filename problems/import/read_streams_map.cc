#include "problems/import/read_streams_map.h"

#include "problems/common/error.h"

namespace trueline {
namespace {

void ReadOffset(const YamlMap& map, TimeSource* time) {
  const YAML::Node node = map.RawNode("offset");
  if (!map.Has("offset")) return;
  if (!node.IsMap()) {
    time->offset_by_file.emplace_back("*", map.Get<double>("offset"));
    return;
  }
  const YamlMap by_file = map.Child("offset");
  for (const std::string& pattern : by_file.Keys()) {
    time->offset_by_file.emplace_back(pattern, by_file.Get<double>(pattern));
  }
}

std::size_t ReadInputName(const YamlMap& map, const std::vector<InputMap>& inputs) {
  std::vector<std::string> names;
  for (const InputMap& input : inputs) names.push_back(input.name);
  const std::string name = map.GetChoice("input", names, names.front());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
  }
  return 0;
}

// The settings that all streams share.
StreamMap ReadSettings(const YamlMap& map, const std::vector<InputMap>& inputs) {
  StreamMap stream;
  stream.input = ReadInputName(map, inputs);
  stream.time = map.Has("time") ? ReadTimeSource(map.Child("time")) : inputs[stream.input].time;
  if (map.Has("time") && !map.Child("time").Has("offset")) {
    stream.time.offset_by_file = inputs[stream.input].time.offset_by_file;
  }
  stream.drop_unsorted =
      map.GetChoice("unsorted", {"refuse", "drop"},
                    inputs[stream.input].drop_unsorted ? "drop" : "refuse") == "drop";
  stream.skip_missing = map.Get<bool>("skip_missing", false);
  stream.filter = RowFilter(map);
  return stream;
}

// Archive that reads the source of each field from the stream's part of a map.
class SourceReader {
 public:
  SourceReader(const YamlMap& map, const SourceAxes& axes, std::vector<FieldSource>* sources)
      : map_(map), axes_(axes), sources_(sources) {}

  // A vector may have axes of its own beside those of the stream's attitude.
  void operator()(const Field& field, const Eigen::Vector3d&) const {
    const YamlMap map = map_.Child(field.key);
    const SourceAxes own = ReadAxes(map, ReadAxes(map_, axes_));
    FieldSource source{field.key, NumberSource(map, field.unit, 3), {}, own.earth};
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
    const bool of_stream = *field.key == '\0';
    Add(field, of_stream ? NumberSource::Single(map_, field.unit)
                         : NumberSource::Single(map_.Child(field.key), field.unit));
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

  const YamlMap& map_;
  const SourceAxes& axes_;
  std::vector<FieldSource>* sources_;
};

}  // namespace

TimeSource ReadTimeSource(const YamlMap& map) {
  TimeSource time;
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
  map.Child("imu");  // required: the error if absent
  const FlightLog log;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    map.RawNode(stream.name);  // marks it as known, though absent
    if (!map.Has(stream.name)) return;
    const YamlMap child = map.Child(stream.name);
    StreamMap& read = streams[stream.name] = ReadSettings(child, inputs);
    SourceReader reader(child, axes, &read.fields);
    const SampleOf<decltype(samples)> sample{};
    sample.Describe(reader, sample, stream);
    child.Finish();
  });
  map.Finish();
  return streams;
}

}  // namespace trueline
