// Settings that hold for some files only.
#pragma once

#include <string>

namespace trueline {

// Whether `pattern` (with * and ?) matches the file's name without its folder.
bool Fits(const std::string& pattern, const std::string& path);

}  // namespace trueline
