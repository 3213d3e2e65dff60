// A CSV file of any origin, row by row.
#pragma once

#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/common/error.h"
#include "problems/common/units.h"
#include "problems/log/csv_text.h"
#include "problems/log/text_file.h"

namespace trueline {

// One row of a foreign log: a line of a CSV file, or a record of one of a recording's channels.

// A map names a column that the log does not have.
class UnknownColumn : public InputError {
 public:
  using InputError::InputError;
};

class ForeignRow {
 public:
  virtual ~ForeignRow() = default;

  // Index of a column given by its name (or in CSV by its number from 1); `where` is the place in
  // the map that names it, for the error: UnknownColumn.
  virtual int IndexOf(const std::string& column, const std::string& where) const = 0;

  // Equal for equal values of one column.
  virtual std::string_view Text(int index) const = 0;
  // NaN where it is missing. Throws InputError for text that is no number.
  virtual double Number(int index) const = 0;
  // Exact to a nanosecond; `exponent` as for ParseTime().
  virtual TimeNs Time(int index, int exponent) const = 0;
  // The row's own time, of measurement where the log states it.
  virtual TimeNs Stamp() const = 0;
  // Whether Stamp() is the time of recording because that of measurement is not set.
  virtual bool IsUnstamped() const { return false; }
  // Rises from row to row of a file, whatever their channels.
  virtual std::size_t Place() const = 0;

  // An error that names the place and the column.
  virtual InputError ErrorIn(int index, const std::string& message) const = 0;
  [[noreturn]] void Fail(int index, const std::string& message) const {
    throw ErrorIn(index, message);
  }
  // The error for a row of `stream` in which Number() found a missing value.
  virtual InputError MissingError(const std::string& stream) const = 0;

 protected:
  // The value; where it is missing, MissingError() names this column.
  double Noted(int index, double value) const {
    if (!std::isfinite(value)) missing_ = index;
    return value;
  }
  mutable int missing_ = -1;  // column of the row's last missing value
};

class ForeignCsv : public ForeignRow {
 public:
  ForeignCsv(const std::filesystem::path& path, const CsvDialect& dialect,
             std::vector<std::string>* warnings);

  // False at the end; a last line that is cut off is dropped with a warning. Blank lines are
  // skipped. Throws InputError for a row whose number of fields is not that of the first row.
  bool Next();

  // Valid after the first Next().
  int IndexOf(const std::string& column, const std::string& where) const override;

  std::string_view Text(int index) const override {
    return fields_[static_cast<std::size_t>(index)];
  }
  double Number(int index) const override;  // NaN if the field is empty or says so
  TimeNs Time(int index, int exponent) const override;
  TimeNs Stamp() const override { return 0; }  // a CSV map names the column of the time
  std::size_t Place() const override { return static_cast<std::size_t>(line()); }

  // "file:line: column 'name': message".
  InputError ErrorIn(int index, const std::string& message) const override;
  InputError MissingError(const std::string& stream) const override;
  const std::string& file() const { return lines_.file(); }
  int line() const { return lines_.line_number(); }

 private:
  std::string ColumnName(int index) const;
  std::string OtherDelimiter() const;
  bool IsCutOff();
  bool SkipsLine(std::string_view line);

  LineReader lines_;
  char delimiter_;
  ValueSplitter splitter_;
  std::vector<std::string>* warnings_;
  std::string header_;        // the line of names
  bool has_skipped_ = false;  // a line among the rows, which a warning tells once
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::size_t width_ = 0;        // fields of the first row
  bool last_is_number_ = false;  // the last field of the row before
};

}  // namespace trueline
