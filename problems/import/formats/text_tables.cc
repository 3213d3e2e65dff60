#include "problems/import/formats/text_tables.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"
#include "problems/log/line_reader.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

// Rows of numbers; the first column is the time, exact to a nanosecond.
class TextDecoder : public MessageDecoder {
 public:
  TextDecoder(std::vector<ChannelField> fields, char delimiter, int time_exponent)
      : fields_(std::move(fields)), delimiter_(delimiter), time_exponent_(time_exponent) {
    fields_.front().unit = "ns";
  }

  bool Describe(std::string_view, Channel* channel) override {
    channel->fields = fields_;
    channel->stamp_field = 0;
    return true;
  }
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<std::string_view> texts;
    SplitFields(message, delimiter_, &texts);
    TimeNs time = 0;
    if (texts.size() != cells->size() || !ParseTime(texts[0], time_exponent_, &time)) return false;
    (*cells)[0] = Cell(time);
    ParseCells(texts, 1, cells);
    return true;
  }

 private:
  std::vector<ChannelField> fields_;
  char delimiter_;
  int time_exponent_;
};

// "w_RS_S_x [rad s^-1]"
ChannelField ParseAslColumn(std::string_view text) {
  if (text.starts_with('#')) text.remove_prefix(1);
  const std::size_t unit = text.find(" [");
  ChannelField field{std::string(TrimmedField(text.substr(0, unit))), ""};
  if (unit != std::string_view::npos && text.ends_with(']')) {
    field.unit = text.substr(unit + 2, text.size() - unit - 3);
  }
  return field;
}

void AddRows(LineReader* lines, char delimiter, int time_exponent, std::size_t channel,
             MessageSink* sink) {
  for (std::string_view line; lines->NextFilled(&line);) {
    if (line.starts_with('#')) continue;
    std::vector<std::string_view> texts;
    SplitFields(line, delimiter, &texts);
    TimeNs time = 0;
    if (!texts.empty()) ParseTime(texts[0], time_exponent, &time);
    sink->Add(channel, time, line);
  }
}

fs::path AslRoot(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
}

std::vector<fs::path> AslSensors(const fs::path& folder) {
  std::vector<fs::path> sensors;
  for (const auto& entry : fs::directory_iterator(AslRoot(folder))) {
    if (fs::is_regular_file(entry.path() / "data.csv")) sensors.push_back(entry.path());
  }
  std::sort(sensors.begin(), sensors.end());
  return sensors;
}

}  // namespace

bool IsAsl(const fs::path& folder) { return !AslSensors(folder).empty(); }

void WalkAsl(const fs::path& path, MessageSink* sink) {
  for (const fs::path& sensor : AslSensors(path)) {
    LineReader lines(sensor / "data.csv");
    std::string_view header;
    if (!lines.Next(&header) || !header.starts_with('#')) {
      throw ErrorAt(lines.file(), 1,
                    "must start with the line of column names, '#timestamp [ns],"
                    "...'; restore it");
    }
    std::vector<std::string_view> columns;
    SplitFields(header, ',', &columns);
    std::vector<ChannelField> fields;
    for (const std::string_view column : columns) fields.push_back(ParseAslColumn(column));
    const std::size_t channel = sink->AddChannel(sensor.filename().string(), 0, "", [&] {
      return std::make_unique<TextDecoder>(fields, ',', 0);
    });
    AddRows(&lines, ',', 0, channel, sink);
  }
}

void WalkTum(const fs::path& path, MessageSink* sink) {
  std::vector<ChannelField> fields;
  for (const char* name : {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"}) {
    fields.push_back({name, ""});
  }
  const std::size_t channel = sink->AddChannel(
      "trajectory", 0, "", [&] { return std::make_unique<TextDecoder>(fields, ' ', 9); });
  LineReader lines(path);
  AddRows(&lines, ' ', 9, channel, sink);
}

bool HasRowsOf(std::size_t count, std::string_view start) {
  std::size_t rows = 0;
  while (!start.empty()) {
    const std::size_t end = start.find('\n');
    if (end == std::string_view::npos && rows > 0) break;  // a line that may be cut here
    const std::string_view line = TrimmedField(start.substr(0, end));
    start.remove_prefix(std::min(end, start.size() - 1) + 1);
    if (line.empty() || line.starts_with('#')) continue;
    std::vector<std::string_view> texts;
    SplitFields(line, ' ', &texts);
    double value = 0.0;
    const auto is_number = [&](std::string_view text) { return ParseNumber(text, &value); };
    if (texts.size() != count || !std::all_of(texts.begin(), texts.end(), is_number)) return false;
    ++rows;
  }
  return rows > 0;
}

}  // namespace trueline
