// One CSV stream of a native log, row by row: header, units, stamps and numbers checked.
#pragma once

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/common/units.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"
#include "problems/log/units.h"

namespace trueline {

struct Column {
  std::string name;
  std::string unit;       // SI
  bool numbered = false;  // stands for name1, name2, ...: as many as the header has, at least one
};

// Reads `t` and the wanted columns, in any order in the file, converted to SI.
//
//   StreamReader reader(path, {{"x", "m"}}, &warnings);
//   while (reader.Next()) Use(reader.time(), reader.value(0));
//
// Throws InputError naming file, line and column for whatever can't be used; drops a last line that
// is cut off, and ignores unknown columns, each with a warning.
class StreamReader {
 public:
  StreamReader(const std::filesystem::path& path, std::vector<Column> columns,
               std::vector<std::string>* warnings)
      : lines_(path), columns_(std::move(columns)), warnings_(warnings) {
    ReadHeader();
    ExpandNumbered();
    SelectColumns();
  }

  bool Next() {
    std::string_view line;
    if (!lines_.NextFilled(&line)) return false;
    if (row_bytes_ == 0) row_bytes_ = line.size() + 1;
    const TimeNs previous = time_;
    SplitFields(line, ',', &fields_);
    if (!ParseRow()) {
      const bool short_row = fields_.size() < names_.size();
      if (!lines_.AtEnd() || (lines_.terminated() && !short_row)) FailRow();
      warnings_->push_back(lines_.CutOff());
      return false;
    }
    CheckRow(previous);
    ++rows_;
    return true;
  }
  TimeNs time() const { return time_; }
  double value(int column) const { return values_[static_cast<std::size_t>(column)]; }
  const std::vector<double>& values() const { return values_; }
  int line() const { return lines_.line_number(); }
  // Rows to expect, from the file's size and the first row's; for reserving memory.
  std::size_t EstimatedRows() const {
    const auto bytes = std::filesystem::file_size(lines_.file());
    return static_cast<std::size_t>(bytes) / std::max<std::size_t>(row_bytes_, 8) + 16;
  }

  // An InputError at the row last read.
  [[noreturn]] void Fail(const std::string& column, const std::string& message) const {
    throw ErrorAt(lines_.file(), line(), fmt::format("column '{}': {}", column, message));
  }
  // True if the row last read is the last one and has no newline: it may be truncated inside a
  // number. Warns that it is dropped.
  bool DropAsCutOff() {
    if (lines_.terminated() || !lines_.AtEnd()) return false;
    warnings_->push_back(lines_.CutOff());
    return true;
  }

 private:
  void ReadHeader() {
    std::string_view line;
    if (!lines_.Next(&line)) {
      throw ErrorAt(lines_.file(), 0, "the file is empty; write a header line such as 't [s],...'");
    }
    for (const HeaderColumn& column : SplitHeader(line)) {
      if (IndexOf(names_, column.name) >= 0) {
        throw ErrorAt(lines_.file(), 1,
                      fmt::format("column '{}' occurs twice; keep one", column.name));
      }
      names_.push_back(column.name);
      units_.push_back(column.unit);
    }
  }
  void ExpandNumbered() {
    std::vector<Column> wanted = std::move(columns_);
    columns_.clear();
    for (const Column& column : wanted) {
      const auto name = [&](int k) { return fmt::format("{}{}", column.name, k); };
      if (!column.numbered) columns_.push_back(column);
      for (int k = 1; column.numbered && (k == 1 || IndexOf(names_, name(k)) >= 0); ++k) {
        columns_.push_back({name(k), column.unit});
      }
    }
  }
  void SelectColumns() {
    const auto require = [&](const std::string& name) {
      const int index = IndexOf(names_, name);
      if (index >= 0) return index;
      throw ErrorAt(
          lines_.file(), 1,
          fmt::format("column '{}' is missing; the header has: {}", name, fmt::join(names_, ", ")));
    };
    time_index_ = require("t");
    time_exponent_ = TimeExponent(FactorOf({"t", "s"}, time_index_));
    std::vector<bool> used(names_.size(), false);
    used[static_cast<std::size_t>(time_index_)] = true;
    for (const Column& column : columns_) {
      index_.push_back(require(column.name));
      factor_.push_back(FactorOf(column, index_.back()));
      used[static_cast<std::size_t>(index_.back())] = true;
    }
    CheckStatedUnits();
    values_.resize(columns_.size());
    std::vector<std::string> ignored;
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) ignored.push_back(names_[i]);
    }
    if (!ignored.empty()) {
      warnings_->push_back(fmt::format("{}: column{} {} not known here and ignored", lines_.file(),
                                       ignored.size() > 1 ? "s" : "", fmt::join(ignored, ", ")));
    }
  }
  double FactorOf(const Column& column, int index) const {
    const std::string& unit = units_[static_cast<std::size_t>(index)];
    if (unit.empty()) return 1.0;
    if (const auto factor = UnitFactor(column.unit, unit)) return *factor;
    const bool separated = unit.find_first_of(";\t") != std::string::npos;
    throw ErrorAt(
        lines_.file(), 1,
        fmt::format("column '{}': unit '{}' is not known here; {} {}", column.name, unit,
                    separated ? "separate columns by commas, and use one of:" : "use one of:",
                    KnownUnits(column.unit)));
  }
  // A column without a unit is in SI, as in a header "ax [m/s^2], ay, az". If another column of its
  // kind states another unit, SI would be a guess, so the file is refused.
  void CheckStatedUnits() const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (!units_[static_cast<std::size_t>(index_[i])].empty()) continue;
      for (std::size_t j = 0; j < columns_.size(); ++j) {
        if (columns_[j].unit != columns_[i].unit || factor_[j] == 1.0) continue;
        throw ErrorAt(
            lines_.file(), 1,
            fmt::format("column '{}' states no unit, but '{}' is in {}; write '{} [unit]' "
                        "with one of: {}",
                        columns_[i].name, columns_[j].name,
                        units_[static_cast<std::size_t>(index_[j])], columns_[i].name,
                        KnownUnits(columns_[i].unit)));
      }
    }
  }
  // False when the row has another number of fields than the header, or a wanted field is no
  // number.
  bool ParseRow() {
    if (fields_.size() != names_.size()) return false;
    if (!ParseTime(Field(time_index_), time_exponent_, &time_)) return false;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (!ParseNumber(Field(index_[i]), &values_[i])) return false;
      values_[i] *= factor_[i];
    }
    return true;
  }
  void CheckRow(TimeNs previous) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (std::abs(values_[i]) <= kLargest) continue;
      Fail(columns_[i].name,
           fmt::format("found '{}', which is {}; remove the row or repair it", Field(index_[i]),
                       std::isfinite(values_[i]) ? "beyond anything that flies" : "not finite"));
    }
    if (rows_ > 0 && time_ <= previous) {
      Fail("t",
           fmt::format("{} s does not come after {} s of the row before; sort the rows and remove "
                       "repeated stamps",
                       TimeText(time_), TimeText(previous)));
    }
  }
  [[noreturn]] void FailRow() const {
    if (fields_.size() != names_.size()) {
      throw ErrorAt(
          lines_.file(), line(),
          fmt::format("found {} fields where the header has {}; repair or remove the line",
                      fields_.size(), names_.size()));
    }
    TimeNs time = 0;
    if (!ParseTime(Field(time_index_), time_exponent_, &time)) {
      Fail("t",
           Field(time_index_).empty()
               ? "the time stamp is missing; every row needs one"
               : fmt::format("'{}' is no time stamp; write a decimal number", Field(time_index_)));
    }
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      double value = 0.0;
      if (ParseNumber(Field(index_[i]), &value)) continue;
      Fail(columns_[i].name,
           fmt::format("'{}' is no number; repair or remove the line", Field(index_[i])));
    }
    Fail("t", "can't be read");
  }
  std::string_view Field(int index) const { return fields_[static_cast<std::size_t>(index)]; }

  static int IndexOf(const std::vector<std::string>& names, const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
  }

  // In SI units, of every stream. Squares and products of what is larger overflow in a fit.
  static constexpr double kLargest = 1e9;

  LineReader lines_;
  std::vector<Column> columns_;
  std::vector<std::string>* warnings_;

  std::vector<std::string> names_;  // of the header
  std::vector<std::string> units_;  // of the header; empty where none is stated
  std::vector<int> index_;          // of each wanted column in the header
  std::vector<double> factor_;
  int time_index_ = -1;
  int time_exponent_ = 9;

  std::vector<std::string_view> fields_;
  TimeNs time_ = 0;
  std::vector<double> values_;
  std::size_t rows_ = 0;
  std::size_t row_bytes_ = 0;
};

}  // namespace trueline
