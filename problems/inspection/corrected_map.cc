#include "problems/inspection/corrected_map.h"

#include <fmt/format.h>

#include <functional>
#include <map>

#include "problems/import/source.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"

namespace trueline {
namespace {

constexpr std::array<const char*, 4> kComponents = {"w", "x", "y", "z"};

SourceAxes AxesOf(const YAML::Node& node, const SourceAxes& fallback) {
  return ReadAxes(YamlMap(node, "map", ""), fallback);
}

void Multiply(YAML::Node node, const char* key, double factor, bool if_missing) {
  if (!node[key]) {
    if (if_missing) node[key] = fmt::format("{:.9g}", factor);
    return;
  }
  if (node[key].IsSequence()) {
    for (YAML::Node item : node[key]) item = fmt::format("{:.9g}", factor * item.as<double>());
  } else {
    node[key] = fmt::format("{:.9g}", factor * node[key].as<double>());
  }
}

// A vector's axes and scale. `body`: whether its native axes are those of the body.
void CorrectVector(YAML::Node stream, const char* field, const SourceAxes& outer, bool body,
                   const Eigen::Matrix3d& turn, double scale) {
  if (IsIdentity(turn) && scale == 1.0) return;
  YAML::Node node = stream[field];
  const SourceAxes axes = AxesOf(node, AxesOf(stream, outer));
  if (!IsIdentity(turn) && body && node["attitude"]) {  // given in earth axes
    const SourceAxes own = AxesOf(node["attitude"], axes);
    node["attitude"]["body"] = AxesNode(turn * own.body);
  } else if (!IsIdentity(turn)) {
    node[body ? "body" : "earth"] = AxesNode(turn * (body ? axes.body : axes.earth));
  }
  if (scale == 1.0 || node["geodetic"]) return;
  Multiply(node, "scale", scale, true);
  Multiply(node, "offset", scale, false);
}

void CorrectAttitude(YAML::Node stream, const SourceAxes& outer, const StreamRepair& repair) {
  const char* key = stream["quaternion"] ? "quaternion" : stream["matrix"] ? "matrix" : "euler";
  if (!stream[key]) return;
  if (std::string(key) == "quaternion") {
    const YAML::Node old = YAML::Clone(stream[key]);
    for (std::size_t i = 0; i < 4; ++i) {
      stream[key][kComponents[i]] =
          old[kComponents[static_cast<std::size_t>(repair.quaternion[i])]];
    }
  }
  if (!repair.angle_order.empty()) {
    YAML::Node angles = stream[key];
    angles["order"] = repair.angle_order;
    if (!angles["scale"] || !angles["scale"].IsSequence()) {
      const std::string all = angles["scale"] ? angles["scale"].Scalar() : "1";
      angles["scale"] = std::vector<std::string>(3, all);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double factor = repair.angle_factor[static_cast<Eigen::Index>(i)];
      angles["scale"][i] = fmt::format("{:.9g}", factor * angles["scale"][i].as<double>());
    }
  }
  if (repair.inverse) {
    const bool before = stream[key]["inverse"] && stream[key]["inverse"].as<bool>();
    stream[key]["inverse"] = !before;
  }
  const SourceAxes axes = AxesOf(stream, outer);
  // A position of the stream keeps its own earth.
  if (!IsIdentity(repair.earth) && stream["position"] && !stream["position"]["earth"]) {
    stream["position"]["earth"] = AxesNode(axes.earth);
  }
  if (!IsIdentity(repair.earth)) stream["earth"] = AxesNode(repair.earth * axes.earth);
  if (!IsIdentity(repair.body)) stream["body"] = AxesNode(repair.body * axes.body);
}

void AddOffset(YAML::Node time, double seconds) {
  if (time["offset"] && time["offset"].IsMap()) {
    for (auto entry : time["offset"]) {
      time["offset"][entry.first.as<std::string>()] =
          fmt::format("{:.6f}", entry.second.as<double>() + seconds);
    }
    return;
  }
  const double before = time["offset"] ? time["offset"].as<double>() : 0.0;
  time["offset"] = fmt::format("{:.6f}", before + seconds);
}

void CorrectTime(const YAML::Node& map, YAML::Node stream, double seconds) {
  if (seconds == 0.0) return;
  const YAML::Node inputs = map["inputs"];
  const YAML::Node input =
      stream["input"] ? inputs[stream["input"].as<std::string>()] : inputs.begin()->second;
  YAML::Node time = stream["time"]  ? YAML::Clone(stream["time"])
                    : input["time"] ? YAML::Clone(input["time"])
                                    : YAML::Node(YAML::NodeType::Map);
  if (!time["offset"] && input["time"] && input["time"]["offset"]) {
    time["offset"] = YAML::Clone(input["time"]["offset"]);
  }
  AddOffset(time, seconds);
  stream["time"] = time;
}

void CorrectOrder(YAML::Node stream, const std::vector<std::size_t>& order) {
  if (order.empty()) return;
  const auto sort = [&](const char* key) {
    if (!stream[key] || (std::string(key) != "columns" && !stream[key].IsSequence())) return;
    const YAML::Node old = YAML::Clone(ExpandColumns(stream[key]));
    YAML::Node sorted;
    for (const std::size_t i : order) sorted.push_back(old[i]);
    stream[key] = sorted;
  };
  for (const char* key : {"columns", "scale", "offset"}) sort(key);
}

// Rows that are left out, by times after all offsets, or as repeats.
void CorrectRows(const StreamRepair& repair, YAML::Node stream) {
  for (const auto& [from, until] : repair.leave_out) {
    YAML::Node part;
    part.SetStyle(YAML::EmitterStyle::Flow);
    for (const TimeNs t : {from, until}) {
      part.push_back(fmt::format("{:.9f}", ToSeconds(t) + repair.time_offset));
    }
    stream["leave_out"].push_back(part);
  }
  if (!repair.only_new || stream["new_where"]) return;
  for (const char* field : {"position", "quaternion", "euler", "matrix"}) {
    YAML::Node source = stream[field];
    if (!source) continue;
    for (const char* list : {"columns", "geodetic"}) {
      if (!source[list]) continue;
      for (const YAML::Node& column : ExpandColumns(source[list])) {
        if (column.IsScalar()) stream["new_where"].push_back(column.Scalar());
      }
    }
    for (const char* part : {"w", "x", "y", "z", "roll", "pitch", "yaw"}) {
      if (source[part]) stream["new_where"].push_back(source[part].Scalar());
    }
  }
}

void CorrectStream(const YAML::Node& map, const SourceAxes& outer, const StreamRepair& repair,
                   YAML::Node stream) {
  CorrectRows(repair, stream);
  if (stream["position"]) {
    CorrectVector(stream, "position", outer, false, repair.position, repair.position_scale);
  }
  if (stream["accel"]) {
    CorrectVector(stream, "accel", outer, true, repair.accel, repair.accel_scale);
    CorrectVector(stream, "gyro", outer, true, repair.gyro, repair.gyro_scale);
  }
  CorrectAttitude(stream, outer, repair);
  CorrectOrder(stream, repair.order);
  if (repair.channel_scale != 1.0) Multiply(stream, "scale", repair.channel_scale, true);
  CorrectTime(map, stream, repair.time_offset);
}

// States the attitude of `by`, as corrected, beside the accelerometer's columns.
void CorrectForce(const StreamRepair& repair, const SourceAxes& outer, const YAML::Node& by,
                  YAML::Node imu) {
  YAML::Node accel = imu["accel"], attitude;
  const SourceAxes axes = AxesOf(by, outer);
  for (const char* form : {"quaternion", "matrix", "euler"}) {
    if (by[form]) attitude[form] = YAML::Clone(by[form]);
  }
  attitude["earth"] = AxesNode(axes.earth);
  attitude["body"] = AxesNode(axes.body);
  accel["attitude"] = attitude;
  if (repair.force_in_earth) accel["earth"] = AxesNode(axes.earth);
  if (!repair.force_in_earth) accel["axes"] = "body";
  if (repair.gravity_removed != 0.0) accel["gravity"] = "removed";
}

// Columns by their name without the unit.
std::map<std::string, HeaderColumn> HeaderOf(const std::filesystem::path& path) {
  LineReader lines(path);
  std::string_view line;
  lines.NextFilled(&line);
  std::map<std::string, HeaderColumn> columns;
  for (const HeaderColumn& column : SplitHeader(line)) columns[column.name] = column;
  return columns;
}

// Archive that writes each field's source into a stream's part of the map.
class SourceWriter {
 public:
  SourceWriter(const std::map<std::string, HeaderColumn>& header, YAML::Node* stream)
      : header_(header), stream_(*stream) {}

  void operator()(const Field& field, const Eigen::Vector3d&) {
    YAML::Node node;
    for (int i = 0; i < 3; ++i)
      node["columns"].push_back(At(field.columns[static_cast<std::size_t>(i)]).text);
    SetUnit(field, At(field.columns[0]), &node);
    stream_[field.key] = node;
  }
  void operator()(const Field& field, const Eigen::Quaterniond&) {
    YAML::Node node;
    for (const char* column : field.columns) node[std::string(1, column[1])] = At(column).text;
    stream_["quaternion"] = node;
  }
  void operator()(const Field& field, double) { Single(field); }
  void operator()(const Field& field, int) { Single(field); }
  void operator()(const Field& field, const std::vector<double>& values) {
    for (std::size_t k = 1; k <= values.size(); ++k) {
      stream_["columns"].push_back(At(fmt::format("{}{}", field.columns[0], k)).text);
    }
    SetUnit(field, At(fmt::format("{}1", field.columns[0])), &stream_);
  }

 private:
  HeaderColumn At(const std::string& name) const {
    const auto found = header_.find(name);
    return found == header_.end() ? HeaderColumn{name} : found->second;
  }
  static void SetUnit(const Field& field, const HeaderColumn& column, YAML::Node* node) {
    const std::string unit = column.unit.empty() ? field.unit : column.unit;
    if (unit != "1") (*node)["unit"] = unit;
  }
  void Single(const Field& field) {
    YAML::Node node = *field.key == '\0' ? stream_ : YAML::Node();
    node["column"] = At(field.columns[0]).text;
    SetUnit(field, At(field.columns[0]), &node);
    if (*field.key != '\0') stream_[field.key] = node;
  }

  const std::map<std::string, HeaderColumn>& header_;
  YAML::Node stream_;
};

}  // namespace

FileAttitudes FileAttitudesOf(const ImportMap& map) {
  FileAttitudes sources;
  for (const auto& [name, stream] : map.streams) {
    for (const FieldSource& field : stream.fields) {
      if (*field.key.c_str() != '\0' || !field.attitude) continue;
      const auto imu = map.streams.find("imu");
      const bool beside = imu != map.streams.end() && imu->second.input == stream.input &&
                          imu->second.channels == stream.channels && stream.type.empty();
      sources[name] = {field.attitude->axes(), field.attitude->form(), beside};
    }
  }
  return sources;
}

YAML::Node CorrectMap(const YAML::Node& map, const Repairs& repairs) {
  YAML::Node corrected = YAML::Clone(map);
  const SourceAxes outer = AxesOf(corrected, {});
  for (const auto& [name, repair] : repairs.streams) {
    YAML::Node stream = corrected["streams"][name];
    if (repair.IsNone() || !stream) continue;
    if (!stream.IsSequence()) {
      CorrectStream(corrected, outer, repair, stream);
      continue;
    }
    for (YAML::Node one : stream) CorrectStream(corrected, outer, repair, one);
  }
  const auto imu = repairs.streams.find("imu");
  if (imu != repairs.streams.end() && !imu->second.force_by.empty()) {
    CorrectForce(imu->second, outer, corrected["streams"][imu->second.force_by],
                 corrected["streams"]["imu"]);
  }
  if (!repairs.reverse_spins || !corrected["vehicle"]) return corrected;
  for (YAML::Node rotor : corrected["vehicle"]["rotors"]) rotor["spin"] = -rotor["spin"].as<int>();
  return corrected;
}

NativeMap MapOfNativeLog(const FlightLog& log) {
  NativeMap native;
  const std::filesystem::path folder(log.directory);
  const YAML::Node header = YAML::LoadFile((folder / "log.yaml").string());
  native.map["name"] = log.name;
  for (const char* key : {"gravity", "environment"}) {
    if (header[key]) native.map[key] = header[key];
  }
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.empty()) return;
    const std::filesystem::path file = folder / (std::string(stream.name) + ".csv");
    const auto columns = HeaderOf(file);
    const auto time = columns.find("t");
    YAML::Node input, source;
    input["time"]["column"] = time == columns.end() ? "t" : time->second.text;
    input["time"]["unit"] =
        time == columns.end() || time->second.unit.empty() ? "s" : time->second.unit;
    native.map["inputs"][stream.name] = input;
    source["input"] = stream.name;
    SourceWriter writer(columns, &source);
    SampleOf<decltype(samples)>::Describe(writer, samples.front(), stream);
    native.map["streams"][stream.name] = source;
    native.files.push_back(file.string());
  });
  for (const char* key : {"gates", "vehicle"}) {
    if (header[key]) native.map[key] = header[key];
  }
  return native;
}

}  // namespace trueline
