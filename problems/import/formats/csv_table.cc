#include "problems/import/formats/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "problems/common/error.h"
#include "problems/import/formats/text_tables.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"
#include "problems/log/units.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kSampleRows = 1000;  // that show the head, the time column and its unit

std::vector<std::string> Split(std::string_view line, const CsvSeparators& separators) {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators);
  splitter.Split(line, &texts);
  return {texts.begin(), texts.end()};
}

bool IsNumber(const std::string& text) {
  double value = 0.0;
  return ParseNumber(text, &value);
}

std::size_t Count(const std::vector<std::string>& texts, bool (*is)(const std::string&)) {
  return static_cast<std::size_t>(std::count_if(texts.begin(), texts.end(), is));
}

// Whether a line names the columns of a row: it has text where the row has values, or hardly a
// value. A row may hold text, too.
bool AreNames(const std::vector<std::string>& texts, const std::vector<std::string>& row) {
  const std::size_t values = Count(texts, IsValue);
  bool names = false, any_text = false;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    const bool is_text = !texts[i].empty() && !IsValue(texts[i]);
    any_text = any_text || is_text;
    names = names || (is_text && i < row.size() && IsValue(row[i]));
  }
  return any_text && (names || texts.size() != row.size() || 2 * values <= texts.size());
}

// Blanks separate only where nothing else does: names and values may have blanks beside commas.
char DelimiterOf(std::string_view line) {
  const auto count = [line](char c) { return std::count(line.begin(), line.end(), c); };
  char best = ',';
  for (const char candidate : {';', '\t', '|'}) {
    if (count(candidate) > count(best)) best = candidate;
  }
  return count(best) > 0 ? best : ' ';
}

// Commas are decimal where most fields are numbers once they are points, and fewer before.
CsvSeparators SeparatorsOf(std::string_view line) {
  for (const char delimiter : {';', '\t', '|'}) {
    if (line.find(delimiter) == std::string_view::npos) continue;
    const CsvSeparators separators{delimiter, true};
    const std::vector<std::string> with_points = Split(line, separators);
    const std::size_t numbers = Count(with_points, IsNumber);
    const bool are_most = 2 * numbers > with_points.size();
    if (are_most && Count(Split(line, {delimiter, false}), IsNumber) < numbers) return separators;
  }
  return {DelimiterOf(line), false};
}

// A line that starts with '#' and that no row of numbers follows. "# t,x,y" before rows has names.
bool IsComment(std::string_view line, std::string_view next) {
  if (!line.starts_with('#')) return false;
  double number = 0.0;
  return next.starts_with('#') || !ParseNumber(Split(next, SeparatorsOf(next)).front(), &number);
}

// The line of names and rows, or rows.
struct FirstLines {
  std::vector<std::string> lines;
  std::vector<int> numbers;  // of the lines in the file, from 1
};

FirstLines ReadFirstLines(const std::filesystem::path& path) {
  LineReader lines(path);
  FirstLines first;
  std::string_view line;
  while (first.lines.size() <= kSampleRows && lines.NextFilled(&line)) {
    if (first.lines.size() == 1 && IsComment(first.lines.front(), line)) first = {};
    first.lines.emplace_back(line);
    first.numbers.push_back(lines.line_number());
  }
  if (first.lines.empty()) {
    throw ErrorAt(path.string(), 0, "has no line with text; copy the log again");
  }
  return first;
}

// "m/s^2", "[rad/s]" or "(s)" without its brackets.
std::string UnitText(const std::string& text) {
  const bool bracketed = text.size() > 1 && (text.front() == '[' || text.front() == '(');
  return bracketed ? text.substr(1, text.size() - 2) : text;
}

// A line of units or types below the names: text, but for the unit 1.
bool IsUnitsLine(const std::vector<std::string>& texts) {
  const auto is_text = [](const std::string& t) { return !t.empty() && !IsValue(t); };
  return std::any_of(texts.begin(), texts.end(), is_text) &&
         std::all_of(texts.begin(), texts.end(),
                     [&](const std::string& t) { return t.empty() || t == "1" || is_text(t); });
}

// The names of the first line, or numbers.
void NameColumns(const std::vector<std::string>& first, std::size_t width, CsvLayout* layout) {
  if (layout->header && first.size() == width) {
    layout->columns = first;
    for (std::size_t i = 0; i < width; ++i) {
      if (first[i].empty()) layout->columns[i] = std::to_string(i + 1);
    }
    return;
  }
  if (layout->header) {
    layout->warning = fmt::format(
        "the first line names {} columns where the rows have {}; which name belongs to which "
        "column is unknown, so columns go by number",
        first.size(), width);
  }
  for (std::size_t i = 1; i <= width; ++i) layout->columns.push_back(std::to_string(i));
}

// Rows of numbers without names that have a well-known layout.
std::vector<std::string> NamesByShape(const std::vector<std::vector<std::string>>& rows) {
  std::size_t width = rows.empty() ? 0 : rows.front().size();
  if (width > 1 && rows.front().back().empty()) --width;  // a comma ends the lines
  const auto median_norm = [&](std::size_t from, std::size_t count) {
    std::vector<double> norms;
    for (const auto& row : rows) {
      double sum = 0.0, value = 0.0;
      for (std::size_t i = from; i < from + count && i < row.size(); ++i) {
        if (ParseNumber(row[i], &value)) sum += value * value;
      }
      norms.push_back(std::sqrt(sum));
    }
    return UpperMedian(norms);
  };
  if (width < 7) return {};
  const bool is_pose = width >= 8 && std::abs(median_norm(4, 4) - 1.0) < 0.03;
  std::vector<std::string> names;
  if (is_pose && width == 8) names = {"t", "tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  if (is_pose && width >= 11)
    names = {"t", "px", "py", "pz", "qw", "qx", "qy", "qz", "vx", "vy", "vz"};
  if (width == 7) {
    constexpr double kLeast = 6.0, kMost = 20.0;  // m/s^2
    const double first = median_norm(1, 3), second = median_norm(4, 3);
    const bool gyro_first = second > kLeast && second < kMost && first < kLeast;
    if (gyro_first) names = {"t", "gx", "gy", "gz", "ax", "ay", "az"};
    if (first > kLeast && first < kMost && second < kLeast) {
      names = {"t", "ax", "ay", "az", "gx", "gy", "gz"};
    }
  }
  if (names.empty()) return {};
  while (names.size() < rows.front().size()) names.push_back(std::to_string(names.size() + 1));
  return names;
}

// A line after names and units that shows how numbers are written: no comment, nor names again.
const std::string& RowOf(const std::vector<std::string>& lines) {
  if (lines.size() < 4) return lines.back();
  const auto middle = lines.begin() + static_cast<std::ptrdiff_t>(lines.size() / 2);
  const auto row = std::find_if(middle, lines.end(), [](const std::string& line) {
    return !line.starts_with('#') && Count(Split(line, SeparatorsOf(line)), IsNumber) > 0;
  });
  return row == lines.end() ? *middle : *row;
}

// Where the head of a table ends.
struct Head {
  std::size_t names = 0;                 // place of the line of names
  std::vector<std::string> joined = {};  // names of several lines, as of Motive and MultiIndex
};

bool AreUnique(std::vector<std::string> names) {
  std::erase(names, "");
  std::sort(names.begin(), names.end());
  return std::adjacent_find(names.begin(), names.end()) == names.end();
}

// The names of the last line, each after what the lines above say of its column, where that is not
// the same of all columns.
std::vector<std::string> Joined(const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::string> joined(lines.back().size());
  for (const std::vector<std::string>& line : lines) {
    std::vector<std::string> texts = line;
    std::erase(texts, "");
    const bool differ = std::any_of(texts.begin(), texts.end(),
                                    [&](const std::string& t) { return t != texts.front(); });
    if (!differ && &line != &lines.back()) continue;
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i].empty() || IsValue(line[i])) continue;
      joined[i] += (joined[i].empty() ? "" : ".") + line[i];
    }
  }
  return joined;
}

// Lines of a head that have other numbers of fields than the rows are skipped. Where names repeat,
// the lines above tell them apart.
Head HeadOf(const std::vector<std::string>& lines, const std::vector<std::string>& row,
            const CsvSeparators& separators) {
  std::vector<std::vector<std::string>> texts;  // lines of the rows' width before the first row
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < lines.size() / 2; ++i) {
    const std::vector<std::string> line = Split(lines[i], separators);
    if (line.size() != row.size()) continue;
    if (!AreNames(line, row)) {
      // Numbers of bodies, or a row with gaps.
      if (Count(line, IsValue) < Count(row, IsValue)) continue;
      break;
    }
    texts.push_back(Split(lines[i], {separators.delimiter, false}));
    places.push_back(i);
  }
  if (texts.empty()) return {};
  // Of a tracker's file a line above may name the body alone.
  const auto rank = [](const std::vector<std::string>& line) {
    return AreUnique(line) ? std::count(line.begin(), line.end(), "") : 1L << 30;
  };
  const auto unique = std::min_element(
      texts.begin(), texts.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  if (AreUnique(*unique)) return {places[static_cast<std::size_t>(unique - texts.begin())]};
  return {places.back(), texts.size() > 1 ? Joined(texts) : std::vector<std::string>()};
}

// Frames a second by the lines of a head: "FREQUENCY 100", "Capture rate,120", or a number alone as
// Vicon has it. 0 for none.
double RateStatedIn(std::vector<std::string> head) {
  double rate = 0.0;
  for (std::string& line : head) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return std::strchr(",;:=\t", c); }, ' ');
    const std::vector<std::string> words = Split(line, {' ', false});
    const std::string name = words.empty() ? "" : LowerCase(line) + " ";
    const bool says = name.find("rate ") != std::string::npos || name.starts_with("frequency ");
    double number = 0.0;
    if ((says || words.size() == 1) && ParseNumber(words.back(), &number) && number > 1.0) {
      rate = number;
    }
    if (says && rate > 0.0) break;
  }
  return rate;
}

}  // namespace

bool IsValue(const std::string& text) {
  double value = 0.0;
  TimeNs time = 0;
  return ParseNumber(text, &value) || ParseDateTime(text, &time);
}

CsvLayout GuessCsvLayout(const std::filesystem::path& path) {
  FirstLines start = ReadFirstLines(path);
  std::vector<std::string>& lines = start.lines;
  CsvLayout layout;
  const std::string& typical = RowOf(lines);
  layout.separators = SeparatorsOf(typical);
  const std::vector<std::string> row = Split(typical, layout.separators);
  const Head head = HeadOf(lines, row, layout.separators);
  layout.skip_lines = start.numbers[head.names] - 1;
  const auto names = lines.begin() + static_cast<std::ptrdiff_t>(head.names);
  const double rate = RateStatedIn({lines.begin(), names});
  lines.erase(lines.begin(), names);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) rows.push_back(Split(lines[i], layout.separators));
  auto first = Split(lines.front(), layout.separators);
  layout.header = AreNames(first, rows.empty() ? first : row);
  if (layout.header) first = Split(lines.front(), {layout.separators.delimiter, false});
  layout.units_line = rows.size() > 1 && layout.header && IsUnitsLine(rows.front());
  if (layout.units_line) {
    for (const std::string& text : rows.front()) layout.units.push_back(UnitText(text));
    rows.erase(rows.begin());
  }
  const std::size_t width = rows.empty() ? first.size() : rows.front().size();
  // A comma at the end of the rows alone has no name.
  if (layout.header && first.size() + 1 == width && rows.front().back().empty()) {
    first.emplace_back();
  }
  std::vector<std::string> made = head.joined;
  if (layout.header && first.size() == width + 1 && first.front() == "#") {
    made.assign(first.begin() + 1, first.end());  // blanks separate the mark of a comment, too
  }
  NameColumns(made.empty() ? first : made, width, &layout);
  layout.units.resize(layout.units_line ? layout.columns.size() : 0);
  if (rows.size() > 1) rows.pop_back();  // the last line may be cut off
  if (!layout.header && layout.warning.empty()) made = NamesByShape(rows);
  layout.has_made_names = !made.empty();
  if (layout.has_made_names) layout.columns = made;
  std::vector<std::size_t> all(layout.columns.size());
  std::iota(all.begin(), all.end(), 0);
  layout.time = FindTimeColumns(layout, all, rows, true, &layout.time_problem);
  const auto frame =
      std::find_if(layout.columns.begin(), layout.columns.end(),
                   [](const std::string& name) { return LowerCase(name).starts_with("frame"); });
  if (rate > 0.0 && frame != layout.columns.end() && !(layout.time && layout.time->is_named)) {
    layout.time = TimeColumns{static_cast<std::size_t>(frame - layout.columns.begin())};
    layout.time->frame = 1.0 / rate;
    layout.time->is_named = layout.time->is_stated = true;
    layout.time_problem.clear();
  }
  return layout;
}

bool TableDecoder::Describe(std::string_view, Channel* channel) {
  for (const TableColumn& column : columns_) {
    if (column.time_exponent) channel->stamp_field = static_cast<int>(channel->fields.size());
    channel->fields.push_back({column.name, column.time_exponent ? "ns" : column.unit});
  }
  return true;
}

bool TableDecoder::Decode(std::string_view message, std::vector<Cell>* cells) const {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators_);
  splitter.Split(message, &texts);
  if (texts.size() != width_) return false;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const TableColumn& column = columns_[i];
    double value = 0.0;
    if (TimeNs time = 0; column.time_exponent) {
      if (!ParseTime(texts[column.index], *column.time_exponent, &time)) return false;
      (*cells)[i] = Cell(time);
      continue;
    }
    if (!ParseNumber(texts[column.index], &value)) continue;
    (*cells)[i] = Cell(column.scale * value + column.shift);
  }
  return true;
}

void WalkCsv(const std::filesystem::path& path, MessageSink* sink) {
  const CsvLayout layout = GuessCsvLayout(path);
  const std::string unknown = WhyNoTrajectory(path);
  for (const std::string& warning : {layout.warning, unknown}) {
    if (!warning.empty()) sink->Warn(warning);
  }
  std::vector<TableColumn> columns;
  for (std::size_t i = 0; i < layout.columns.size(); ++i) {
    columns.push_back({i, layout.columns[i], layout.units.empty() ? "" : layout.units[i]});
  }
  const std::size_t channel = sink->AddChannel({"rows", 0, ""}, [&] {
    return std::make_unique<TableDecoder>(columns, layout.separators, columns.size());
  });
  LineReader lines(path);
  std::string_view line;
  for (int i = 0; i < layout.LinesBeforeRows(); ++i) lines.Next(&line);
  ValueSplitter splitter(layout.separators);
  std::vector<std::string_view> texts;
  while (lines.NextFilled(&line)) {
    TimeNs time = 0;
    if (layout.time) {
      splitter.Split(line, &texts);
      layout.time->Read(texts, &time);
    }
    sink->Add(channel, time, line);
  }
}

}  // namespace trueline
