// One number of a record, without loss: 64-bit counts of nanoseconds do not fit a double.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

#include "problems/common/units.h"

namespace trueline {

class Cell {
 public:
  Cell() : Cell(std::numeric_limits<double>::quiet_NaN()) {}  // missing
  explicit Cell(double value) { std::memcpy(bytes_, &value, sizeof(value)); }
  explicit Cell(std::int64_t value) : whole_(true) { std::memcpy(bytes_, &value, sizeof(value)); }

  double Number() const {  // not a number where it is missing
    return whole_ ? static_cast<double>(Load<std::int64_t>()) : Load<double>();
  }
  // The number as a count of 10^exponent ns. False, and `time` as it was, if it is missing or does
  // not fit.
  bool Time(int exponent, TimeNs* time) const;
  // Equal for equal numbers of one column.
  std::string_view Bytes() const { return {bytes_, sizeof(bytes_)}; }

 private:
  template <class T>
  T Load() const {
    T value;
    std::memcpy(&value, bytes_, sizeof(value));
    return value;
  }

  char bytes_[8];
  bool whole_ = false;
};

// How a binary format stores a number.
enum class Scalar { kI8, kU8, kI16, kU16, kI32, kU32, kI64, kU64, kF16, kF32, kF64 };

std::size_t SizeOf(Scalar type);
Cell ReadScalar(Scalar type, const char* bytes);  // of SizeOf(type) bytes

}  // namespace trueline
