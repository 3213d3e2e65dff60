#include "problems/import/formats/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
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

// Whether a line has values: most of its fields are numbers, and none is a name.
bool AreNumbers(const std::vector<std::string>& texts) {
  double value = 0.0;
  TimeNs time = 0;
  std::size_t numbers = 0;
  for (const std::string& text : texts) {
    const bool is_value = ParseNumber(text, &value) || ParseDateTime(text, &time);
    if (!is_value && !text.empty()) return false;
    numbers += is_value ? 1 : 0;
  }
  return numbers > 0;
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

// The numbers of a column, in s of dates; empty cells are left out. Empty if one is neither.
std::vector<double> ColumnOf(const std::vector<std::vector<std::string>>& rows,
                             std::size_t column) {
  std::vector<double> values;
  for (const std::vector<std::string>& row : rows) {
    if (column >= row.size()) return {};
    if (row[column].empty()) continue;
    double value = 0.0;
    TimeNs date = 0;
    const bool is_number = ParseNumber(row[column], &value);
    if (!is_number && !ParseDateTime(row[column], &date)) return {};
    values.push_back(is_number ? value : ToSeconds(date));
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

// The unit that a column's name ends in.
std::optional<int> StatedExponent(const std::string& column, const std::string& stated) {
  const std::string name = LowerCase(column);
  const auto says = [&](const char* unit) {
    const std::string end = unit;
    return stated == end || name.ends_with("_" + end) || name.ends_with("[" + end + "]") ||
           name.ends_with("(" + end + ")");
  };
  const auto is = [&](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(),
                       [&](const char* word) { return name.ends_with(word); });
  };
  if (says("ns") || says("nsec") || is({"nanos", "nanoseconds"})) return 0;
  if (says("us") || says("usec") || is({"timeus", "micros", "microseconds"})) return 3;
  if (says("ms") || says("msec") || is({"timems", "millis", "milliseconds"})) return 6;
  if (says("s") || says("sec") || is({"seconds"})) return 9;
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

// A line of units: some are known or in brackets, and none is a value.
bool IsUnitsLine(const std::vector<std::string>& texts) {
  const auto is_unit = [](const std::string& text) {
    const std::string unit = UnitText(text);
    if (unit != text && !unit.empty()) return true;
    for (const char* si : {"s", "m", "m/s", "m/s^2", "rad", "rad/s", "V"}) {
      if (UnitFactor(si, unit)) return true;
    }
    return false;
  };
  const auto is_value = [](const std::string& text) {
    double number = 0.0;
    TimeNs time = 0;
    return text != "1" && (ParseNumber(text, &number) || ParseDateTime(text, &time));
  };
  return std::any_of(texts.begin(), texts.end(), is_unit) &&
         std::none_of(texts.begin(), texts.end(), is_value);
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

// The names of the first line, or numbers.
void NameColumns(const std::vector<std::string>& first, std::size_t width, CsvLayout* layout) {
  layout->header = !AreNumbers(first);
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

// A line after names and units that shows how numbers are written.
const std::string& RowOf(const std::vector<std::string>& lines) {
  return lines.size() < 4 ? lines.back() : lines[lines.size() / 2];
}

// The place of the line of names after a head whose lines have other numbers of fields than the
// rows; 0 where there is no head.
std::size_t NamesAfterHead(const std::vector<std::string>& lines, const CsvSeparators& separators) {
  const CsvSeparators plain{separators.delimiter, false};
  const std::size_t width = Split(lines[lines.size() / 2], separators).size();
  if (Split(lines.front(), plain).size() == width) return 0;
  for (std::size_t i = 1; i < lines.size() / 2; ++i) {
    const std::vector<std::string> names = Split(lines[i], plain);
    if (names.size() == width) return AreNumbers(names) ? 0 : i;
  }
  return 0;
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
                                           bool may_be_unnamed) {
  std::optional<TimeColumns> best;
  int most = 0;
  for (const std::size_t i : which) {
    const int score = TimeScore(layout.columns[i]);
    if (score <= most) continue;
    const std::vector<double> values = TimesOf(layout, i, rows);
    if (values.empty() || !Increases(values)) continue;
    best = TimeColumns{i};
    best->is_named = true;
    most = score;
  }
  for (const std::size_t i : which) {
    if (!best && may_be_unnamed && Rises(ColumnOf(rows, i))) best = TimeColumns{i};
  }
  if (!best) return best;
  const std::vector<double> values = TimesOf(layout, best->column, rows);
  best->step = MedianRise(values);
  best->nanoseconds = NanosecondsBeside(layout, best->column);
  const auto stated =
      best->nanoseconds
          ? 9
          : StatedExponent(layout.columns[best->column],
                           layout.units.empty() ? "" : LowerCase(layout.units[best->column]));
  best->is_stated = stated.has_value();
  best->exponent = stated ? *stated : ExponentOf(values);
  return best;
}

CsvLayout GuessCsvLayout(const std::filesystem::path& path) {
  FirstLines start = ReadFirstLines(path);
  std::vector<std::string>& lines = start.lines;
  CsvLayout layout;
  layout.separators = SeparatorsOf(RowOf(lines));
  std::size_t first_line = NamesAfterHead(lines, layout.separators);
  layout.skip_lines = start.numbers[first_line] - 1;
  lines.erase(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(first_line));
  auto first = Split(lines.front(), layout.separators);
  if (!AreNumbers(first)) first = Split(lines.front(), {layout.separators.delimiter, false});
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) rows.push_back(Split(lines[i], layout.separators));
  layout.units_line = rows.size() > 1 && !AreNumbers(first) && IsUnitsLine(rows.front());
  if (layout.units_line) {
    for (const std::string& text : rows.front()) layout.units.push_back(UnitText(text));
    rows.erase(rows.begin());
  }
  const std::size_t width = rows.empty() ? first.size() : rows.front().size();
  // A comma at the end of the rows alone has no name.
  if (!AreNumbers(first) && first.size() + 1 == width && rows.front().back().empty()) {
    first.emplace_back();
  }
  NameColumns(first, width, &layout);
  layout.units.resize(layout.units_line ? layout.columns.size() : 0);
  if (rows.size() > 1) rows.pop_back();  // the last line may be cut off
  if (!layout.header && layout.warning.empty()) {
    const std::vector<std::string> names = NamesByShape(rows);
    layout.is_named_by_shape = !names.empty();
    if (layout.is_named_by_shape) layout.columns = names;
  }
  std::vector<std::size_t> all(layout.columns.size());
  std::iota(all.begin(), all.end(), 0);
  layout.time = FindTimeColumns(layout, all, rows, true);
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
