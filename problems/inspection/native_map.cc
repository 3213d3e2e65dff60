#include <fmt/format.h>

#include <map>

#include "problems/inspection/corrected_map.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"

namespace trueline {
namespace {

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
