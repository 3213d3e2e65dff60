// Rows of results as text. A row type lists its fields once, in
//   template <class Archive> void Fields(Archive& archive) { archive(label, gamma, error); }
// and these archives write them to a line and read them back, numbers without loss. A field is a
// string without commas, a number, an Eigen vector, a row, or a std::vector of these.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

namespace trueline {

class RowWriter {
 public:
  template <class... T>
  void operator()(const T&... fields) {
    (Add(fields), ...);
  }
  const std::string& line() const { return line_; }

 private:
  void Add(const std::string& text) { line_ += (line_.empty() ? "" : ",") + text; }
  template <int kRows>
  void Add(const Eigen::Matrix<double, kRows, 1>& values) {
    for (const double value : values) Add(value);
  }
  template <class T>
  void Add(const std::vector<T>& values) {
    Add(static_cast<int>(values.size()));
    for (const T& value : values) Add(value);
  }
  template <class T>
  void Add(const T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      Add(fmt::format("{}", +value));
    } else {
      T(value).Fields(*this);
    }
  }

  std::string line_;
};

// Throws InputError at `where` for a line that is no such row.
class RowReader {
 public:
  RowReader(std::string_view line, std::string where) : where_(std::move(where)) {
    SplitFields(line, ',', &fields_);
  }
  template <class... T>
  void operator()(T&... fields) {
    (Take(fields), ...);
  }
  [[noreturn]] void Fail() const {
    throw InputError(where_ + ": not the row of a job file; delete the file");
  }

 private:
  void Take(std::string& text) {
    if (next_ >= fields_.size()) Fail();
    text = fields_[next_++];
  }
  template <int kRows>
  void Take(Eigen::Matrix<double, kRows, 1>& values) {
    for (double& value : values) Take(value);
  }
  template <class T>
  void Take(std::vector<T>& values) {
    int count = 0;
    Take(count);
    if (count < 0 || count > static_cast<int>(fields_.size())) Fail();
    values.resize(count);
    for (T& value : values) Take(value);
  }
  template <class T>
  void Take(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      double number = 0.0;
      if (next_ >= fields_.size() || !ParseNumber(fields_[next_++], &number)) Fail();
      value = static_cast<T>(number);
    } else {
      value.Fields(*this);
    }
  }

  std::string where_;
  std::vector<std::string_view> fields_;
  std::size_t next_ = 0;
};

}  // namespace trueline
