// CSV files of results.
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace trueline {

// Quoted where the text would break the row (RFC 4180).
std::string CsvField(const std::string& text);

// Writes the header and what `rows` prints. The file appears when it is complete.
void WriteCsv(const std::filesystem::path& path, const std::string& header,
              const std::function<void(std::ostream&)>& rows);

}  // namespace trueline
