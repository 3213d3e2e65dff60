#include "problems/experiment/rows.h"

#include <sstream>

namespace trueline {

std::string ToText(JobResult result) {
  std::string text;
  result.ForEachTable([&](std::string kind, auto& rows) {
    for (auto& row : rows) {
      RowText archive(&text);
      archive(kind, row);
      text += "\n";
    }
  });
  return text;
}

JobResult ParseJobResult(const std::string& text, const std::string& file) {
  std::istringstream stream(text);
  JobResult result;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    RowText reader(line, fmt::format("{}:{}", file, number));
    std::string kind;
    reader(kind);
    bool known = false;
    result.ForEachTable([&](const std::string& name, auto& rows) {
      if (name != kind) return;
      reader(rows.emplace_back());
      known = true;
    });
    if (!known) reader.Fail();
  }
  return result;
}

}  // namespace trueline
