// One CSV stream of a native log, row by row: header, units, stamps and numbers checked.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/common/units.h"
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
               std::vector<std::string>* warnings);

  bool Next();
  TimeNs time() const { return time_; }
  double value(int column) const { return values_[static_cast<std::size_t>(column)]; }
  const std::vector<double>& values() const { return values_; }
  int line() const { return lines_.line_number(); }
  // Rows to expect, from the file's size and the first row's; for reserving memory.
  std::size_t EstimatedRows() const;

  // An InputError at the row last read.
  [[noreturn]] void Fail(const std::string& column, const std::string& message) const;
  // True if the row last read is the last one and has no newline: it may be truncated inside a
  // number. Warns that it is dropped.
  bool DropAsCutOff();

 private:
  void ReadHeader();
  void ExpandNumbered();
  void SelectColumns();
  double FactorOf(const Column& column, int index) const;
  void CheckStatedUnits() const;
  bool ParseRow();
  void CheckRow(TimeNs previous) const;
  [[noreturn]] void FailRow() const;
  std::string_view Field(int index) const;

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
