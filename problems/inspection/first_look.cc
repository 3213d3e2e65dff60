#include "problems/inspection/first_look.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/inspection/inspection.h"
#include "problems/log/native_log.h"

namespace trueline {
namespace {

constexpr double kOrdinaryOffset = 0.1;  // s, below which it is a latency, not a clock

// What makes a fit worthless; smaller faults are for those who ask trueline-inspect.
bool IsForAll(const Finding& finding) {
  if (finding.level == Level::kFatal) return true;
  if (finding.id == "clock_offset") return std::abs(finding.size) > kOrdinaryOffset;
  return finding.id == "cover" || finding.id == "attitude_missing";
}

}  // namespace

FlightLog ReadAndLook(const std::filesystem::path& directory) {
  FlightLog log = ReadNativeLog(directory);
  for (const std::string& finding : FirstLook(log)) log.warnings.push_back(finding);
  return log;
}

std::vector<std::string> FirstLook(const FlightLog& log) {
  std::vector<std::string> findings;
  for (const Finding& finding : Inspect(log, {}).findings) {
    if (!IsForAll(finding)) continue;
    findings.push_back(fmt::format("{} ({}): {}. Nothing is corrected; {}. trueline-inspect {}",
                                   finding.id, NameOf(finding.level), finding.text, finding.remedy,
                                   finding.repaired ? "writes the corrected map" : "tells more"));
  }
  return findings;
}

}  // namespace trueline
