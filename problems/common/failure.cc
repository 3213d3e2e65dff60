#include "problems/common/failure.h"

#include <fmt/format.h>
#include <gflags/gflags.h>

#include <cctype>
#include <filesystem>
#include <new>
#include <system_error>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"

namespace trueline {
namespace {

// The log that a program was given, before an error that knows no file.
std::string LogGiven() {
  std::string log;
  for (const char* flag : {"log", "in"}) {
    if (gflags::GetCommandLineOption(flag, &log) && !log.empty()) return log + ": ";
  }
  return "";
}

}  // namespace

std::string Printable(std::string text) {
  for (char& c : text) {
    if (c != '\n' && std::iscntrl(static_cast<unsigned char>(c)) != 0) c = '?';
  }
  return text;
}

Failure CurrentFailure() {
  try {
    throw;
  } catch (const InputError& error) {
    const bool ran = dynamic_cast<const NoUsableResult*>(&error) != nullptr;
    return {ran ? kExitNoResult : kExitBadInput,
            "error: " + Printable(WithFinalNames(error.what()))};
  } catch (const std::filesystem::filesystem_error& error) {
    return {kExitBadInput, fmt::format("error: {}: {}; check the path and its permissions",
                                       Printable(error.path1().string()), error.code().message())};
  } catch (const std::system_error& error) {  // fmt's, when standard output is full
    return {kExitBadInput, fmt::format("error: {}; make room, or write elsewhere", error.what())};
  } catch (const std::bad_alloc&) {
    return {kExitBadInput, fmt::format("error: {}memory is used up; cut the log into shorter ones",
                                       Printable(LogGiven()))};
  } catch (const std::exception& error) {
    return {kExitDefect, fmt::format("internal error, please report it: {}", error.what())};
  }
}

}  // namespace trueline
