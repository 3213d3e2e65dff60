#include "problems/common/app.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <sstream>
#include <system_error>

#include "problems/common/error.h"

namespace trueline {

std::string Version() { return TRUELINE_VERSION; }

int RunGuarded(const std::string& program, const std::function<int()>& body) {
  try {
    return body();
  } catch (const InputError& error) {
    fmt::print(stderr, "{}: error: {}\n", program, error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: internal error, please report it: {}\n", program, error.what());
    return kExitDefect;
  }
}

void Warn(const std::string& message, bool quiet) {
  if (!quiet) fmt::print(stderr, "warning: {}\n", message);
}

std::vector<std::string> SplitList(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

std::string FindShared(const std::string& relative_path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  std::vector<fs::path> candidates;
  if (!error) {
    candidates.push_back(program.parent_path().parent_path() / "share/trueline" / relative_path);
  }
  candidates.push_back(fs::path(TRUELINE_SOURCE_DIR) / relative_path);
  candidates.push_back(fs::path(TRUELINE_SOURCE_DIR) / "scripts" / relative_path);
  candidates.push_back(fs::path(TRUELINE_SHARE_DIR) / relative_path);
  for (const fs::path& candidate : candidates) {
    if (fs::exists(candidate, error)) return candidate.string();
  }
  throw InputError(fmt::format("'{}' is not installed; run cmake --install or use the source tree",
                               relative_path));
}

}  // namespace trueline
