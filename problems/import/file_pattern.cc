#include "problems/import/file_pattern.h"

#include <fnmatch.h>

#include <filesystem>

namespace trueline {

bool Fits(const std::string& pattern, const std::string& path) {
  return fnmatch(pattern.c_str(), std::filesystem::path(path).filename().c_str(), 0) == 0;
}

}  // namespace trueline
