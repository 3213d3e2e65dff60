#include "problems/import/formats/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
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
constexpr std::size_t kFewRows = 50;       // of a log that may have less than 5 Hz

class CsvRowDecoder : public MessageDecoder {
 public:
  explicit CsvRowDecoder(const CsvLayout& layout) : separators_(layout.separators) {
    for (std::size_t i = 0; i < layout.columns.size(); ++i) {
      fields_.push_back({layout.columns[i], layout.units.empty() ? "" : layout.units[i]});
    }
  }

  bool Describe(std::string_view, Channel* channel) override {
    channel->fields = fields_;
    return true;
  }
  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    std::vector<std::string_view> texts;
    ValueSplitter splitter(separators_);
    splitter.Split(message, &texts);
    if (texts.size() != cells->size()) return false;
    ParseCells(texts, 0, cells);
    return true;
  }

 private:
  std::vector<ChannelField> fields_;
  CsvSeparators separators_;
};

std::vector<std::string> Split(std::string_view line, const CsvSeparators& separators) {
  std::vector<std::string_view> texts;
  ValueSplitter splitter(separators);
  splitter.Split(line, &texts);
  return {texts.begin(), texts.end()};
}

bool IsValue(const std::string& text) {
  double value = 0.0;
  TimeNs time = 0;
  return ParseNumber(text, &value) || ParseDateTime(text, &time);
}

std::size_t CountValues(const std::vector<std::string>& texts) {
  return static_cast<std::size_t>(std::count_if(texts.begin(), texts.end(), IsValue));
}

// Whether a line names the columns of a row: it has text where the row has values, or hardly a
// value. A row may hold text, too.
bool AreNames(const std::vector<std::string>& texts, const std::vector<std::string>& row) {
  const std::size_t values = CountValues(texts);
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

std::size_t CountNumbers(const std::vector<std::string>& texts) {
  double value = 0.0;
  const auto count = std::count_if(texts.begin(), texts.end(), [&value](const std::string& text) {
    return ParseNumber(text, &value);
  });
  return static_cast<std::size_t>(count);
}

// Commas are decimal where most fields are numbers once they are points, and fewer before.
CsvSeparators SeparatorsOf(std::string_view line) {
  for (const char delimiter : {';', '\t', '|'}) {
    if (line.find(delimiter) == std::string_view::npos) continue;
    const CsvSeparators separators{delimiter, true};
    const std::vector<std::string> with_points = Split(line, separators);
    const std::size_t numbers = CountNumbers(with_points);
    const bool are_most = 2 * numbers > with_points.size();
    if (are_most && CountNumbers(Split(line, {delimiter, false})) < numbers) return separators;
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

// The last part of a name in lower case, after marks as in "# time" and "%time".
std::string BareName(const std::string& column) {
  std::string name = LowerCase(column);
  name.erase(0, std::min(name.find_first_not_of("#%*_/ "), name.size()));
  return std::string(TrimmedField(std::string_view(name).substr(0, name.find_first_of("[("))));
}

// How surely a name is that of the time of measurement; 0 for a name of something else.
int TimeScore(const std::string& column) {
  const std::string name = BareName(column);
  const std::string last = name.substr(name.find_last_of("./") + 1);
  const auto any = [&](std::initializer_list<std::string_view> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](std::string_view word) { return name.find(word) != std::string::npos; });
  };
  // "t", "t_s", "t [ms]", but not "theta".
  const bool is_t = last.starts_with('t') &&
                    (last.size() == 1 || std::isalpha(static_cast<unsigned char>(last[1])) == 0);
  int score = is_t ? 30 : 0;
  for (const char* word : {"time", "stamp"}) {
    if (last.starts_with(word) || last.ends_with(word)) score = 30;
  }
  for (const char* end : {"time_s", "time_ms", "time_us", "time_ns", "timeus", "timems"}) {
    if (last.ends_with(end)) score = 30;
  }
  if (score == 0 && any({"header.stamp", "header/stamp", "time"})) score = 20;
  for (const char* word : {"elapsed", "clock", "seconds", "secs", "sec", "millis", "micros",
                           "nanos", "tout", "tick", "epoch", "date"}) {
    if (score == 0 && last.starts_with(word)) score = 15;
  }
  if (score == 0) return 0;
  if (any({"sample", "header.stamp", "header/stamp", "sensor", "measure", "device"})) score += 10;
  if (any({"recv", "receive", "record", "arriv", "publi", "host", "utc", "log_", "write", "left",
           "delta", "diff", "relative", "integral"})) {
    score -= 10;
  }
  return score;
}

// The numbers of a column, in s of dates; empty cells are left out. Empty if more than a few rows
// have something else.
std::vector<double> ColumnOf(const std::vector<std::vector<std::string>>& rows,
                             std::size_t column) {
  constexpr std::size_t kOneIn = 10;  // may be a comment or names again
  std::vector<double> values;
  std::size_t others = 0;
  for (const std::vector<std::string>& row : rows) {
    if (column < row.size() && row[column].empty()) continue;
    double value = 0.0;
    TimeNs date = 0;
    const bool is_number = column < row.size() && ParseNumber(row[column], &value);
    if (is_number || (column < row.size() && ParseDateTime(row[column], &date))) {
      values.push_back(is_number ? value : ToSeconds(date));
    } else if (kOneIn * ++others > rows.size()) {
      return {};
    }
  }
  return values;
}

// A count of rows, which some writers put before the names.
bool IsRunningNumber(const std::vector<double>& values) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] - values[i - 1] != 1.0) return false;
  }
  return !values.empty() && (values.front() == 0.0 || values.front() == 1.0);
}

// A name of what counts rows, frames or messages.
bool NamesCount(const std::string& column) {
  const std::string name = BareName(column);
  for (const char* start : {"frame", "sample", "index", "idx", "seq", "count", "row", "unnamed"}) {
    if (name.starts_with(start)) return true;
  }
  return name == "id" || name == "no" || name == "nr" || name == "n" || name == "number";
}

bool Rises(const std::vector<double>& values) {
  const auto not_after = [](double a, double b) { return !(b > a); };
  return values.size() > 1 && !IsRunningNumber(values) &&
         std::adjacent_find(values.begin(), values.end(), not_after) == values.end();
}

// A counter may wrap, and rows may be out of order.
bool Increases(const std::vector<double>& values) {
  std::size_t back = 0, on = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    back += values[i] < values[i - 1] ? 1 : 0;
    on += values[i] > values[i - 1] ? 1 : 0;
  }
  return values.size() == 1 || (on > 0 && 20 * back <= on);
}

// Of the columns' steps; repeated stamps have none.
double MedianRise(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) steps.push_back(values[i] - values[i - 1]);
  }
  return steps.empty() ? 0.0 : UpperMedian(steps);
}

// A stamp since 1970 in a unit whose name is not known, by its size.
int ExponentBySize(double size) { return size > 1e17 ? 0 : size > 1e14 ? 3 : size > 1e11 ? 6 : 9; }

// Whether rows at such a step are those of a log.
bool IsStepOfLog(double step, int exponent) {
  const double seconds = step * std::pow(10.0, exponent - 9);
  return seconds > 2e-5 && seconds < 1.5;
}

// Units of time by name, as powers of ten of a nanosecond; below zero: one that is not read.
constexpr int kUnreadUnit = -1;
constexpr auto kTimeUnits =
    std::to_array<std::pair<std::string_view, int>>({{"ns", 0},
                                                     {"nsec", 0},
                                                     {"nanos", 0},
                                                     {"nanoseconds", 0},
                                                     {"us", 3},
                                                     {"usec", 3},
                                                     {"micros", 3},
                                                     {"microseconds", 3},
                                                     {"timeus", 3},
                                                     {"ms", 6},
                                                     {"msec", 6},
                                                     {"millis", 6},
                                                     {"milliseconds", 6},
                                                     {"timems", 6},
                                                     {"s", 9},
                                                     {"sec", 9},
                                                     {"secs", 9},
                                                     {"seconds", 9},
                                                     {"min", kUnreadUnit},
                                                     {"minutes", kUnreadUnit},
                                                     {"h", kUnreadUnit},
                                                     {"hours", kUnreadUnit},
                                                     {"ticks", kUnreadUnit}});

// The unit that a column's name ends in.
std::optional<int> StatedExponent(const std::string& column, const std::string& stated) {
  const std::string name = LowerCase(column);
  for (const auto& [unit, exponent] : kTimeUnits) {
    const bool is_stated = stated == unit || name.ends_with(fmt::format("_{}", unit)) ||
                           name.ends_with(fmt::format("[{}]", unit)) ||
                           name.ends_with(fmt::format("({})", unit));
    if (is_stated) return exponent;
  }
  for (const auto& [unit, exponent] : kTimeUnits) {
    if (unit.size() > 4 && name.ends_with(unit)) return exponent;
  }
  return std::nullopt;
}

// By the size of a stamp since 1970 if the step between rows fits that, else by the step: logs have
// 5 Hz to 5 kHz.
int ExponentOf(const std::vector<double>& values) {
  const double step = MedianRise(values);
  const double size = std::abs(values.front());
  const int by_size = ExponentBySize(size);
  if (by_size < 9 && (step == 0.0 || IsStepOfLog(step, by_size))) return by_size;
  const bool may_be_epoch = size > 1e9 && size < 4e9 && step < 5.0;
  const bool is_whole = std::all_of(values.begin(), values.end(),
                                    [](double value) { return value == std::floor(value); });
  if (may_be_epoch && !is_whole) return 9;
  if (step > 1.9e5) return 0;
  if (step > 190.0) return 3;
  return step > 0.19 && (step > 0.9 || values.size() > kFewRows) ? 6 : 9;
}

// The column of nanoseconds beside one of seconds, as "stamp.nanosec" beside "stamp.sec".
std::optional<std::size_t> NanosecondsBeside(const CsvLayout& layout, std::size_t seconds) {
  const std::string name = LowerCase(layout.columns[seconds]);
  for (const auto& [whole, part] : {std::pair{"secs", "nsecs"},
                                    {"sec", "nanosec"},
                                    {"sec", "nsec"},
                                    {"sec", "nanoseconds"},
                                    {"s", "ns"}}) {
    if (!name.ends_with(whole)) continue;
    const std::string other = name.substr(0, name.size() - std::string_view(whole).size()) + part;
    for (std::size_t i = 0; i < layout.columns.size(); ++i) {
      if (LowerCase(layout.columns[i]) == other) return i;
    }
  }
  return std::nullopt;
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

// A column of times, with the nanoseconds beside it.
std::vector<double> TimesOf(const CsvLayout& layout, std::size_t column,
                            const std::vector<std::vector<std::string>>& rows) {
  std::vector<double> values = ColumnOf(rows, column);
  const auto nanoseconds = NanosecondsBeside(layout, column);
  const std::vector<double> parts =
      nanoseconds ? ColumnOf(rows, *nanoseconds) : std::vector<double>();
  if (parts.size() != values.size()) return values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += 1e-9 * parts[i];
  return values;
}

// Why a column that is named as a time gives none.
std::string WhyUnread(const CsvLayout& layout, std::size_t column,
                      const std::vector<std::vector<std::string>>& rows) {
  const std::vector<std::string>& row = rows[rows.size() / 2];
  const std::string text = column < row.size() ? row[column] : "";
  const std::string& name = layout.columns[column];
  if (!IsValue(text)) {
    return fmt::format(
        "column '{}' reads '{}', which is no time that is known; give s since any start, or "
        "2024-05-01T23:59:55.010Z",
        name, text);
  }
  return fmt::format(
      "column '{}' does not rise from row to row (it reads {}); export it with all its digits, or "
      "name another",
      name, text);
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
        "the first line names {} columns where the rows have {}; which names are whose is not "
        "known, so that columns go by number",
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
    return !line.starts_with('#') && CountNumbers(Split(line, SeparatorsOf(line))) > 0;
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
    std::vector<std::string> line = Split(lines[i], {separators.delimiter, false});
    if (line.size() != row.size()) continue;
    if (!AreNames(line, row)) {
      if (CountValues(line) < CountValues(row)) continue;  // numbers of bodies, or a row with gaps
      break;
    }
    texts.push_back(std::move(line));
    places.push_back(i);
  }
  if (texts.empty()) return {};
  const auto unique = std::find_if(texts.begin(), texts.end(), AreUnique);
  if (unique != texts.end()) return {places[static_cast<std::size_t>(unique - texts.begin())]};
  return {places.back(), texts.size() > 1 ? Joined(texts) : std::vector<std::string>()};
}

}  // namespace

bool TimeColumns::Read(const std::vector<std::string_view>& texts, TimeNs* time) const {
  TimeNs read = 0, part = 0;
  if (column >= texts.size()) return false;
  if (!ParseTime(texts[column], exponent, &read) && !ParseDateTime(texts[column], &read)) {
    return false;
  }
  if (nanoseconds && *nanoseconds < texts.size()) ParseTime(texts[*nanoseconds], 0, &part);
  *time = read + part;
  return true;
}

std::optional<TimeColumns> FindTimeColumns(const CsvLayout& layout,
                                           const std::vector<std::size_t>& which,
                                           const std::vector<std::vector<std::string>>& rows,
                                           bool may_be_unnamed, std::string* problem) {
  constexpr int kSurely = 20;
  std::optional<TimeColumns> best;
  std::string unread;
  int most = 0;
  for (const std::size_t i : which) {
    const int score = TimeScore(layout.columns[i]);
    if (score <= most) continue;
    const std::vector<double> values = TimesOf(layout, i, rows);
    if (values.empty() || !Increases(values)) {
      if (score >= kSurely && unread.empty() && !rows.empty()) unread = WhyUnread(layout, i, rows);
      continue;
    }
    best = TimeColumns{i};
    best->is_named = true;
    most = score;
  }
  for (const std::size_t i : which) {
    if (!best && unread.empty() && may_be_unnamed && !NamesCount(layout.columns[i]) &&
        Rises(ColumnOf(rows, i))) {
      best = TimeColumns{i};
    }
  }
  if (!best && problem != nullptr) *problem = unread;
  if (!best) return best;
  const std::vector<double> values = TimesOf(layout, best->column, rows);
  best->step = MedianRise(values);
  best->nanoseconds = NanosecondsBeside(layout, best->column);
  const std::string unit = layout.units.empty() ? "" : LowerCase(layout.units[best->column]);
  const auto stated = best->nanoseconds ? 9 : StatedExponent(layout.columns[best->column], unit);
  if (stated && *stated == kUnreadUnit) {
    if (problem != nullptr) {
      *problem = fmt::format("the unit of time of column '{}' is not read; give s, ms, us or ns",
                             layout.columns[best->column]);
    }
    return std::nullopt;
  }
  best->is_stated = stated.has_value();
  best->exponent = stated ? *stated : ExponentOf(values);
  return best;
}

CsvLayout GuessCsvLayout(const std::filesystem::path& path) {
  FirstLines start = ReadFirstLines(path);
  std::vector<std::string>& lines = start.lines;
  CsvLayout layout;
  layout.separators = SeparatorsOf(RowOf(lines));
  const std::vector<std::string> row = Split(RowOf(lines), layout.separators);
  const Head head = HeadOf(lines, row, layout.separators);
  layout.skip_lines = start.numbers[head.names] - 1;
  lines.erase(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(head.names));
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
  return layout;
}

void WalkCsv(const std::filesystem::path& path, MessageSink* sink) {
  const CsvLayout layout = GuessCsvLayout(path);
  const std::string unknown = WhyNoTrajectory(path);
  for (const std::string& warning : {layout.warning, unknown}) {
    if (!warning.empty()) sink->Warn(warning);
  }
  const std::size_t channel =
      sink->AddChannel({"rows", 0, ""}, [&] { return std::make_unique<CsvRowDecoder>(layout); });
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
