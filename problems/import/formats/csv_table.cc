#include "problems/import/formats/csv_table.h"

#include <algorithm>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"
#include "problems/log/line_reader.h"

namespace trueline {
namespace {

class CsvRowDecoder : public MessageDecoder {
 public:
  CsvRowDecoder(std::vector<ChannelField> fields, char delimiter)
      : fields_(std::move(fields)), delimiter_(delimiter) {}

  bool Describe(std::string_view, Channel* channel) override {
    channel->fields = fields_;
    return true;
  }
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<std::string_view> texts;
    SplitFields(message, delimiter_, &texts);
    if (texts.size() != cells->size()) return false;
    ParseCells(texts, 0, cells);
    return true;
  }

 private:
  std::vector<ChannelField> fields_;
  char delimiter_;
};

}  // namespace

char GuessDelimiter(std::string_view line) {
  char best = ',';
  for (const char candidate : {',', ';', '\t', ' '}) {
    const auto count = [line](char c) { return std::count(line.begin(), line.end(), c); };
    if (count(candidate) > count(best)) best = candidate;
  }
  return best;
}

void WalkCsv(const std::filesystem::path& path, MessageSink* sink) {
  LineReader lines(path);
  std::string_view line;
  if (!lines.NextFilled(&line)) {
    throw ErrorAt(path.string(), 0, "has no line with text; copy the log again");
  }
  const char delimiter = GuessDelimiter(line);
  std::vector<std::string_view> texts;
  SplitFields(line, delimiter, &texts);
  std::vector<ChannelField> fields;
  std::size_t time_column = texts.size();
  for (std::size_t i = 0; i < texts.size(); ++i) {
    fields.push_back({std::string(texts[i]), ""});
    if (time_column == texts.size() && texts[i].starts_with('t')) time_column = i;
  }
  const std::size_t channel = sink->AddChannel(
      "rows", 0, "", [&] { return std::make_unique<CsvRowDecoder>(fields, delimiter); });
  while (lines.NextFilled(&line)) {
    SplitFields(line, delimiter, &texts);
    TimeNs time = 0;
    if (time_column < texts.size()) ParseTime(texts[time_column], 9, &time);
    sink->Add(channel, time, line);
  }
}

}  // namespace trueline
