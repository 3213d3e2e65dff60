// Rows of results as text. A row type lists its fields once, in
//   template <class Archive> void Fields(Archive& archive) { archive(label, gamma, error); }
// and this archive writes them to a line or reads them back, numbers without loss. A field is a
// string without commas, a number, an Eigen vector, a row, or a std::vector of these.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

namespace trueline {

class RowText {
 public:
  // Appends the fields to `line`.
  explicit RowText(std::string* line) : line_(line) {}
  // Reads them from `line`. Throws InputError at `where` for a line that is no such row.
  RowText(std::string_view line, std::string where) : where_(std::move(where)) {
    SplitFields(line, ',', &fields_);
  }
  template <class... T>
  void operator()(T&... fields) {
    (Field(fields), ...);
  }
  [[noreturn]] void Fail() const {
    throw InputError(where_ + ": not the row of a job file; delete the file");
  }

 private:
  void Field(std::string& text) {
    if (line_ != nullptr) {
      *line_ += (line_->empty() || line_->back() == '\n' ? "" : ",") + text;
    } else if (next_ < fields_.size()) {
      text = fields_[next_++];
    } else {
      Fail();
    }
  }
  template <class T>
  void Field(std::vector<T>& values) {
    int count = static_cast<int>(values.size());
    Field(count);
    if (count < 0 || (line_ == nullptr && count > static_cast<int>(fields_.size()))) Fail();
    values.resize(count);
    for (T& value : values) Field(value);
  }
  template <class T>
  void Field(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      std::string text = fmt::format("{}", +value);
      double number = 0.0;
      Field(text);
      if (line_ != nullptr) return;
      if (!ParseNumber(text, &number)) Fail();
      value = static_cast<T>(number);
    } else if constexpr (requires { value.Fields(*this); }) {
      value.Fields(*this);
    } else {
      for (double& number : value) Field(number);
    }
  }

  std::string* line_ = nullptr;  // null: reading
  std::string where_;
  std::vector<std::string_view> fields_;
  std::size_t next_ = 0;
};

}  // namespace trueline
