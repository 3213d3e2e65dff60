// Settings that hold for some files only.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace trueline {

// The first of `patterns` (with * and ?) that matches the file's name without its folder.
std::optional<std::string> FirstFitting(const std::vector<std::string>& patterns,
                                        const std::string& path);

}  // namespace trueline
