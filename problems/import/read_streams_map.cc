#include "problems/import/read_streams_map.h"

#include "problems/common/error.h"

namespace trueline {
namespace {

using Inputs = std::vector<InputMap>;

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

std::size_t ReadInputName(const YamlMap& map, const Inputs& inputs) {
  std::vector<std::string> names;
  for (const InputMap& input : inputs) names.push_back(input.name);
  const std::string name = map.GetChoice("input", names, names.front());
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
  }
  return 0;
}

// The part that all streams share.
StreamMap ReadStream(const YamlMap& map, const Inputs& inputs) {
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

ImuMap ReadImu(const YamlMap& map, const SourceAxes& axes, const Inputs& inputs) {
  ImuMap imu{ReadStream(map, inputs), {}, {}, {}, {}, {}};
  const YamlMap accel = map.Child("accel");
  const YamlMap gyro = map.Child("gyro");
  const SourceAxes own = ReadAxes(map, axes);
  const SourceAxes accel_axes = ReadAxes(accel, own);
  imu.accel = ArraySource(accel, Dimension::kAcceleration, 3);
  imu.gyro = ArraySource(gyro, Dimension::kAngularRate, 3);
  imu.accel_axes = accel_axes.body;
  imu.gyro_axes = ReadAxes(gyro, own).body;
  if (accel.Has("attitude")) {
    const YamlMap attitude = accel.Child("attitude");
    imu.accel_axes = accel_axes.earth;
    imu.accel_attitude = SourceAttitude(attitude, accel_axes);
    attitude.Finish();
  }
  accel.Finish();
  gyro.Finish();
  return imu;
}

AttitudeMap ReadAttitude(const YamlMap& map, const SourceAxes& axes, const Inputs& inputs) {
  return {ReadStream(map, inputs), SourceAttitude(map, axes)};
}

// A position may have an `earth` of its own beside the attitude's.
ArraySource ReadPosition(const YamlMap& map, const SourceAxes& axes, Eigen::Matrix3d* to_native) {
  const YamlMap position = map.Child("position");
  *to_native = ReadAxes(position, ReadAxes(map, axes)).earth;
  ArraySource source(position, Dimension::kLength, 3);
  position.Finish();
  return source;
}

FixMap ReadFixes(const YamlMap& map, const SourceAxes& axes, const Inputs& inputs) {
  FixMap fixes{ReadStream(map, inputs), {}, {}, {}, ScalarSource(0.0)};
  fixes.position = ReadPosition(map, axes, &fixes.axes);
  fixes.sigma = ScalarSource(map.Child("sigma"), Dimension::kLength);
  if (map.Has("gate")) fixes.gate = ScalarSource(map.Child("gate"), Dimension::kNone);
  return fixes;
}

PoseMap ReadPose(const YamlMap& map, const SourceAxes& axes, const Inputs& inputs) {
  PoseMap pose{ReadStream(map, inputs), {}, {}, SourceAttitude(map, axes)};
  pose.position = ReadPosition(map, axes, &pose.axes);
  return pose;
}

}  // namespace

TimeSource ReadTimeSource(const YamlMap& map) {
  TimeSource time;
  map.Get<std::string>("column");
  time.column = SourceColumn(map.RawNode("column"), map.file());
  const std::string unit = map.Get<std::string>("unit", "s");
  const auto factor = UnitFactor(Dimension::kTime, unit);
  if (!factor) {
    map.Fail("unit", fmt::format("'{}' is not known here; use one of: {}", unit,
                                 KnownUnits(Dimension::kTime)));
  }
  time.exponent = TimeExponent(*factor);
  const auto scale = map.GetOptional<double>("scale");
  if (scale && !(*scale > 0.0)) map.Fail("scale", "must be positive");
  if (scale) time.factor = *scale * *factor;
  ReadOffset(map, &time);
  map.Finish();
  return time;
}

void ReadStreamsMap(const YamlMap& map, const SourceAxes& axes, ImportMap* import) {
  const Inputs& inputs = import->inputs;
  // Reads one stream where the map has it; unknown keys inside are refused.
  const auto read = [&](const char* name, auto* stream, const auto& reader) {
    if (!map.Has(name)) {
      map.RawNode(name);  // marks it as known, though absent
      return;
    }
    const YamlMap child = map.Child(name);
    stream->emplace(reader(child));
    child.Finish();
  };
  const auto channels = [&](Dimension dimension) {
    return [&inputs, dimension](const YamlMap& m) {
      return ChannelsMap{ReadStream(m, inputs), ArraySource(m, dimension, 0)};
    };
  };
  const auto scalar = [&](Dimension dimension) {
    return [&inputs, dimension](const YamlMap& m) {
      StreamMap stream = ReadStream(m, inputs);
      return ScalarMap{std::move(stream), ScalarSource(m, dimension)};
    };
  };
  const auto pose = [&](const YamlMap& m) { return ReadPose(m, axes, inputs); };
  map.Child("imu");  // required: the error if absent
  read("imu", &import->imu, [&](const YamlMap& m) { return ReadImu(m, axes, inputs); });
  read("attitude", &import->attitude,
       [&](const YamlMap& m) { return ReadAttitude(m, axes, inputs); });
  read("fixes", &import->fixes, [&](const YamlMap& m) { return ReadFixes(m, axes, inputs); });
  read("pose", &import->pose, pose);
  read("mocap", &import->mocap, pose);
  read("rotors", &import->rotors, channels(Dimension::kAngularRate));
  read("motors", &import->motors, channels(Dimension::kNone));
  read("battery", &import->battery, scalar(Dimension::kVoltage));
  read("range", &import->range, scalar(Dimension::kLength));
  map.Finish();
}

}  // namespace trueline
