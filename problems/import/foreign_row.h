// One row of a foreign log: a line of a CSV file, or a record of one of a recording's channels.
#pragma once

#include <string>
#include <string_view>

#include "problems/common/error.h"
#include "problems/common/time.h"

namespace trueline {

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
};

}  // namespace trueline
