#include "problems/import/file_pattern.h"

#include <fnmatch.h>

#include <filesystem>

namespace trueline {

std::optional<std::string> FirstFitting(const std::vector<std::string>& patterns,
                                        const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  for (const std::string& pattern : patterns) {
    if (fnmatch(pattern.c_str(), name.c_str(), 0) == 0) return pattern;
  }
  return std::nullopt;
}

}  // namespace trueline
