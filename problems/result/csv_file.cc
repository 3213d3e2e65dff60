#include "problems/result/csv_file.h"

#include <fmt/ostream.h>

#include "problems/common/atomic_file.h"

namespace trueline {

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string(2, c) : std::string(1, c);
  return quoted + "\"";
}

void WriteCsv(const std::filesystem::path& path, const std::string& header,
              const std::function<void(std::ostream&)>& rows) {
  AtomicFile file(path);
  fmt::print(file.stream(), "{}\n", header);
  rows(file.stream());
  file.Commit();
}

}  // namespace trueline
