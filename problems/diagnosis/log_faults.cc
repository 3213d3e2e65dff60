#include "problems/diagnosis/log_faults.h"

#include <algorithm>

namespace trueline {
namespace {

// Faults that effects state as well: late sensors, scales.
bool IsInCatalogue(const LogFault& fault) {
  return fault.id == "clock_offset" || fault.id == "accelerometer_scale";
}

}  // namespace

void AddLogFaults(const std::vector<LogFault>& faults, Diagnosis* diagnosis) {
  for (const LogFault& fault : faults) diagnosis->log_faults.push_back(fault.text);
  const auto blocks = [&](const LogFault& fault) {
    return fault.fatal || (diagnosis->verdict == "clean" && !IsInCatalogue(fault));
  };
  if (std::any_of(faults.begin(), faults.end(), blocks)) diagnosis->verdict = "unexplained";
}

}  // namespace trueline
