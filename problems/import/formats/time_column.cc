// Which column of a table is its time, and in what unit.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "problems/import/formats/csv_table.h"
#include "problems/log/csv_text.h"
#include "problems/log/units.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kFewRows = 50;  // of a log that may have less than 5 Hz

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
  for (const char* word : {"time", "stamp", "zeit", "temps", "tiempo", "tempo"}) {
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

// Of .NET: 100 ns since the year 1. As nanoseconds since 1970 they would end in 1992.
bool AreTicks(double size) { return size > 6.2e17 && size < 7e17; }

// A stamp since 1970 in a unit whose name is not known, by its size.
int ExponentBySize(double size) {
  if (AreTicks(size)) return kTicksExponent;
  return size > 1e17 ? 0 : size > 1e14 ? 3 : size > 1e11 ? 6 : 9;
}

// Whether rows at such a step are those of a log.
bool IsStepOfLog(double step, int exponent) {
  const double seconds = step * std::pow(10.0, exponent - 9);
  return seconds > 2e-5 && seconds < 1.5;
}

// Units of time by their names, as powers of ten of a nanosecond; below zero: ones that are not
// read.
constexpr int kUnreadUnit = -1;
const std::map<int, std::vector<std::string>> kTimeUnits = {
    {0, {"ns", "nsec", "nanos", "nanoseconds"}},
    {3, {"us", "usec", "micros", "microseconds", "timeus"}},
    {6, {"ms", "msec", "millis", "milliseconds", "timems"}},
    {9, {"s", "sec", "secs", "seconds"}},
    {kUnreadUnit, {"min", "minutes", "h", "hours", "ticks"}}};

// The unit that a column's name ends in: "_ms", "[ms]", "(ms)", or a long one in any way.
std::optional<int> StatedExponent(const std::string& column, const std::string& stated) {
  const std::string name = LowerCase(column);
  for (const bool whole : {true, false}) {
    for (const auto& [exponent, units] : kTimeUnits) {
      for (const std::string& unit : units) {
        const bool is_stated = stated == unit || name.ends_with("_" + unit) ||
                               name.ends_with("[" + unit + "]") || name.ends_with("(" + unit + ")");
        if (whole ? is_stated : unit.size() > 4 && name.ends_with(unit)) return exponent;
      }
    }
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

}  // namespace

bool TimeColumns::Read(const std::vector<std::string_view>& texts, TimeNs* time) const {
  TimeNs read = 0, part = 0;
  double count = 0.0;
  if (column >= texts.size()) return false;
  if (frame > 0.0) {
    const bool is_number = ParseNumber(texts[column], &count);
    if (is_number) *time = FromSeconds((count - 1.0) * frame);
    return is_number;
  }
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
  auto stated = best->nanoseconds ? 9 : StatedExponent(layout.columns[best->column], unit);
  if (AreTicks(values.front())) stated = kTicksExponent;
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

}  // namespace trueline
