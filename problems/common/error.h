// Errors that a user can mend, kept apart from defects of the program.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace trueline {

// Bad input or usage. The message names where (file, line, column or key), what was found and
// what would do. Executables print it and exit with 2; the library only ever throws it.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// "file:line: message" or, for line 0, "file: message".
inline InputError ErrorAt(const std::string& file, int line, const std::string& message) {
  return InputError(line > 0 ? fmt::format("{}:{}: {}", file, line, message)
                             : fmt::format("{}: {}", file, message));
}

}  // namespace trueline
