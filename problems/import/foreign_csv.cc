#include "problems/import/foreign_csv.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/log/units.h"

namespace trueline {
namespace {

bool IsNumber(const std::string& text) {
  return !text.empty() && std::all_of(text.begin(), text.end(),
                                      [](unsigned char c) { return std::isdigit(c) != 0; });
}

}  // namespace

ForeignCsv::ForeignCsv(const std::filesystem::path& path, const CsvDialect& dialect,
                       std::vector<std::string>* warnings)
    : lines_(path),
      delimiter_(dialect.separators.delimiter),
      splitter_(dialect.separators),
      warnings_(warnings) {
  std::string_view line;
  for (int i = 0; i < dialect.skip_lines + (dialect.header ? 1 : 0); ++i) {
    if (lines_.Next(&line)) continue;
    throw ErrorAt(file(), 0,
                  fmt::format("ends within its header: it has {} lines; check "
                              "'skip_lines'",
                              i));
  }
  if (!dialect.header) return;
  header_ = line;
  SplitFields(line, delimiter_, &fields_);
  names_.assign(fields_.begin(), fields_.end());
  if (dialect.units_line) lines_.Next(&line);
}

// Names that are repeated among the rows, as where files were joined, and comments are skipped.
bool ForeignCsv::SkipsLine(std::string_view line) {
  const bool names = !header_.empty() && line == header_;
  if (!names && !line.starts_with('#')) return false;
  if (!std::exchange(has_skipped_, true)) {
    warnings_->push_back(fmt::format("{}:{}: {} among the rows is skipped", file(), this->line(),
                                     names ? "a line of names" : "a comment"));
  }
  return true;
}

bool ForeignCsv::Next() {
  std::string_view line;
  do {
    if (!lines_.NextFilled(&line)) return false;
  } while (SkipsLine(line));
  splitter_.Split(line, &fields_);
  missing_ = -1;
  if (width_ == 0) width_ = fields_.size();
  if (IsCutOff() && lines_.AtEnd()) {
    warnings_->push_back(lines_.CutOff());
    return false;
  }
  if (fields_.size() != width_) {
    throw ErrorAt(file(), this->line(),
                  fmt::format("found {} fields where the first row has {}; repair or remove the "
                              "line",
                              fields_.size(), width_));
  }
  return true;
}

// A writer that was killed leaves a last line with too few fields, or with half of its last number.
bool ForeignCsv::IsCutOff() {
  double last = 0.0;
  const bool is_number = !fields_.empty() && ParseNumber(fields_.back(), &last);
  if (fields_.size() != width_) return fields_.size() < width_;
  if (!lines_.terminated() && last_is_number_ && !is_number) return true;
  last_is_number_ = is_number;
  return false;
}

int ForeignCsv::IndexOf(const std::string& column, const std::string& where) const {
  const auto named = std::find(names_.begin(), names_.end(), column);
  if (named != names_.end()) {
    // A separator at the end of lines makes an empty field more.
    const auto used = [](const auto& fields) {
      return fields.size() - (!fields.empty() && fields.back().empty() ? 1 : 0);
    };
    if (names_.size() != width_ && used(names_) != used(fields_)) {
      throw InputError(fmt::format(
          "{}: the header of {} names {} columns where the rows have {}, so it is not known which "
          "name is whose; give '{}' by its number from 1",
          where, file(), names_.size(), width_, column));
    }
    if (std::find(named + 1, names_.end(), column) == names_.end()) {
      const auto index = static_cast<std::size_t>(named - names_.begin());
      if (index < width_) return static_cast<int>(index);
    }
    throw InputError(
        fmt::format("{}: column '{}' is not unique in {}; give its number", where, column, file()));
  }
  if (IsNumber(column)) {
    std::size_t number = 0;
    std::from_chars(column.data(), column.data() + column.size(), number);
    if (number >= 1 && number <= width_) return static_cast<int>(number - 1);
    throw InputError(fmt::format("{}: there is no column {} in {}; it has columns 1 to {}", where,
                                 column, file(), width_));
  }
  throw UnknownColumn(fmt::format("{}: there is no column '{}' in {}; its header has: {}{}", where,
                                  column, file(), fmt::join(names_, ", "), OtherDelimiter()));
}

// A remedy where the names look like several in one.
std::string ForeignCsv::OtherDelimiter() const {
  if (names_.size() != 1) return "";
  for (const char other : {';', ',', '\t', '|'}) {
    if (other == delimiter_ || names_.front().find(other) == std::string::npos) continue;
    return fmt::format(", a single name; state the map's input: {{delimiter: {}}}",
                       other == '\t' ? "tab" : fmt::format("\"{}\"", other));
  }
  return "";
}

double ForeignCsv::Number(int index) const {
  double value = std::numeric_limits<double>::quiet_NaN();
  if (Text(index).empty() || ParseNumber(Text(index), &value)) return Noted(index, value);
  const bool comma = Text(index).find(',') != std::string_view::npos;
  Fail(index, fmt::format("'{}' is no number; {}", Text(index),
                          comma ? "state a decimal comma in the map's input: decimal: \",\", or "
                                  "export without separators of thousands"
                                : "repair or remove the line"));
}

TimeNs ForeignCsv::Time(int index, int exponent) const {
  TimeNs time = 0;
  if (ParseTime(Text(index), exponent, &time) || ParseDateTime(Text(index), &time)) return time;
  if (Text(index).empty()) Fail(index, "the time stamp is missing; every row needs one");
  double number = 0.0;
  const bool too_large = ParseNumber(Text(index), &number) && std::isfinite(number);
  Fail(index,
       too_large ? fmt::format("'{}' is too large for a time in this unit; state the column's unit "
                               "in the map, as time: {{unit: ns}}",
                               Text(index))
                 : fmt::format("'{}' is no time stamp; repair or remove the line, or export the "
                               "times in seconds, or as 2024-05-01T23:59:55.010Z",
                               Text(index)));
}

InputError ForeignCsv::ErrorIn(int index, const std::string& message) const {
  return ErrorAt(file(), line(), fmt::format("column {}: {}", ColumnName(index), message));
}

InputError ForeignCsv::MissingError(const std::string& stream) const {
  const std::string remedy = fmt::format(
      "needed by stream '{}'; repair the line, or set 'skip_missing: true' in the map", stream);
  if (missing_ < 0) return ErrorAt(file(), line(), "the quaternion is zero; " + remedy);
  return ErrorIn(missing_,
                 fmt::format("found '{}' where a finite number is {}", Text(missing_), remedy));
}

std::string ForeignCsv::ColumnName(int index) const {
  const auto i = static_cast<std::size_t>(index);
  return i < names_.size() ? fmt::format("'{}'", names_[i]) : std::to_string(index + 1);
}

}  // namespace trueline
