// The text of a CSV field: splitting, numbers, and time stamps without loss.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "problems/common/units.h"

namespace trueline {

std::string_view TrimmedField(std::string_view text);  // without blanks and one pair of quotes

// The fields of one line; a field in quotes may hold the delimiter. With a `delimiter` of ' ' a run
// of blanks and tabs counts as one.
void SplitFields(std::string_view line, char delimiter, std::vector<std::string_view>* fields);

// A column of a native log's header, such as "x [m]".
struct HeaderColumn {
  std::string text;       // as in the file
  std::string name = {};  // without the unit
  std::string unit = {};  // empty where none is stated
};
std::vector<HeaderColumn> SplitHeader(std::string_view line);

// How a CSV file separates.
struct CsvSeparators {
  char delimiter = ',';        // of fields; ' ' stands for runs of blanks and tabs
  bool decimal_comma = false;  // in numbers; the delimiter is then another

  bool operator==(const CsvSeparators&) const = default;
};

// How a table of text is laid out.
struct CsvDialect {
  CsvSeparators separators;
  int skip_lines = 0;       // a head, before names or rows
  bool header = true;       // a line of names follows
  bool units_line = false;  // and below that one of units, as "s,m/s^2", which is skipped

  bool operator==(const CsvDialect&) const = default;
  int LinesBeforeRows() const { return skip_lines + (header ? 1 : 0) + (units_line ? 1 : 0); }
};

// Splits lines of values. A decimal comma is given as a point, a mark of a missing value ("--",
// "NA", "null") as nothing.
class ValueSplitter {
 public:
  explicit ValueSplitter(const CsvSeparators& separators) : separators_(separators) {}

  // The fields point into the line or into this object, until the next call.
  void Split(std::string_view line, std::vector<std::string_view>* fields);

 private:
  CsvSeparators separators_;
  std::string with_points_;
};

// A decimal number in full ("nan" and "inf" parse too). False when `text` is something else.
bool ParseNumber(std::string_view text, double* value);

// A decimal time to whole nanoseconds, rounded to nearest, without passing through a double.
// `exponent` is that of the unit in nanoseconds: 9 for s, 6 for ms, 3 for us, 0 for ns. False when
// `text` is no finite decimal number or does not fit 64 bits.
bool ParseTime(std::string_view text, int exponent, TimeNs* time);

std::string LowerCase(std::string text);  // ASCII

// The time in seconds with nine decimals, exact.
std::string TimeText(TimeNs time);

}  // namespace trueline
