// Logs of any format, recognised by their content.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "problems/import/formats/recording.h"

namespace trueline {

// Throws InputError, with what to do, if the format is not read here.
std::unique_ptr<Recording> OpenRecording(const std::filesystem::path& path);

inline constexpr char kCsvFormat[] = "csv";

// The format's key by the first bytes; empty for none.
std::string FormatOf(const std::filesystem::path& path);
bool IsTextFormat(const std::string& key);  // of lines of numbers
bool IsTable(const std::string& path);      // a file of such a format

std::string KnownFormats();             // "ulog (PX4 ULog), ..."
bool IsFormat(const std::string& key);  // of a map's `format`

}  // namespace trueline
