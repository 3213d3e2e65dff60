#pragma once

#include <filesystem>
#include <string>

namespace trueline {

// Lower-case hexadecimal SHA-256 of a file's bytes. Throws InputError when it can't be read.
std::string Sha256OfFile(const std::filesystem::path& path);
// The same of a text in memory.
std::string Sha256OfText(const std::string& text);

}  // namespace trueline
