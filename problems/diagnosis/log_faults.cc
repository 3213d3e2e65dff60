#include "problems/diagnosis/log_faults.h"

#include <algorithm>

namespace trueline {
namespace {

// Faults that effects state as well: late sensors, scales.
bool IsInCatalogue(const LogFault& fault) {
  return fault.id == "clock_offset" || fault.id == "accelerometer_scale";
}

// What was fitted to a wrong log is no model of the next flight.
void LeaveOutOfModel(Diagnosis* diagnosis) {
  if (diagnosis->in_model.empty()) return;
  diagnosis->in_model.clear();
  for (DescribedTerm& term : diagnosis->open.described) term.in_model = false;
  diagnosis->model_lacks = "all causes and terms, since a fault of the log is fatal";
}

}  // namespace

void AddLogFaults(const std::vector<LogFault>& faults, Diagnosis* diagnosis) {
  for (const LogFault& fault : faults) diagnosis->log_faults.push_back(fault.text);
  const auto blocks = [&](const LogFault& fault) {
    return fault.fatal || (diagnosis->verdict == "clean" && !IsInCatalogue(fault));
  };
  if (std::any_of(faults.begin(), faults.end(), blocks)) diagnosis->verdict = "unexplained";
  const auto fatal = [](const LogFault& fault) { return fault.fatal; };
  if (std::any_of(faults.begin(), faults.end(), fatal)) LeaveOutOfModel(diagnosis);
}

}  // namespace trueline
