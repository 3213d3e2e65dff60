// What a user reads where a verb fails, on the command line and from Python.
#pragma once

#include <string>

namespace trueline {

struct Failure {
  int code;          // the program's exit code
  std::string text;  // names place and remedy; control characters are replaced
};

// Of the exception that is being handled.
Failure CurrentFailure();

// A message quotes what a log holds; its control characters would reach the terminal.
std::string Printable(std::string text);

}  // namespace trueline
