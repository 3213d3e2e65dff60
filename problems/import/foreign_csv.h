// A CSV file of any origin, row by row.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/common/time.h"
#include "problems/log/line_reader.h"

namespace trueline {

struct CsvDialect {
  char delimiter = ',';  // ' ' stands for runs of blanks
  int skip_lines = 0;    // before the header, or before the first row
  bool header = true;    // a line of names follows
};

class ForeignCsv {
 public:
  ForeignCsv(const std::filesystem::path& path, const CsvDialect& dialect,
             std::vector<std::string>* warnings);

  // False at the end; a last line that is cut off is dropped with a warning. Blank lines are
  // skipped. Throws InputError for a row whose number of fields is not that of the first row.
  bool Next();

  // Index of a column given by its name or its number from 1; `where` is the place in the map that
  // names it, for the error. Valid after the first Next().
  int IndexOf(const std::string& column, const std::string& where) const;

  std::string_view Text(int index) const { return fields_[static_cast<std::size_t>(index)]; }
  // NaN if the field is empty or says so. Throws InputError for other text.
  double Number(int index) const;
  // Exact to a nanosecond; `exponent` as for ParseTime().
  TimeNs Time(int index, int exponent) const;

  // "file:line: column 'name': message".
  [[noreturn]] void Fail(int index, const std::string& message) const;
  // The error for a row of `stream` in which Number() found a missing value.
  [[noreturn]] void FailMissing(const std::string& stream) const;
  const std::string& file() const { return lines_.file(); }
  int line() const { return lines_.line_number(); }

 private:
  std::string ColumnName(int index) const;

  LineReader lines_;
  char delimiter_;
  std::vector<std::string>* warnings_;
  std::vector<std::string> names_;
  std::vector<std::string_view> fields_;
  std::size_t width_ = 0;     // fields of the first row
  mutable int missing_ = -1;  // column of the row's last missing value
};

}  // namespace trueline
