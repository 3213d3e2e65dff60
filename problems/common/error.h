// Errors that a user can correct, as opposed to defects of the program.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace trueline {

// Bad input or usage. The message names the place (file, line, column or key), what was found and
// how to correct it. Executables print it and exit with 2; the library only throws it.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Good input that the asked result can't be made of. Executables exit with 3.
class NoUsableResult : public InputError {
 public:
  using InputError::InputError;
};

// "file:line: message" or, for line 0, "file: message".
inline InputError ErrorAt(const std::string& file, int line, const std::string& message) {
  return InputError(line > 0 ? fmt::format("{}:{}: {}", file, line, message)
                             : fmt::format("{}: {}", file, message));
}

}  // namespace trueline
