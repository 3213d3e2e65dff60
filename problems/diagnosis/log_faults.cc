#include "problems/diagnosis/log_faults.h"

#include <algorithm>
#include <span>

namespace trueline {

std::string VerdictWith(const std::vector<LogFault>& faults, const std::string& verdict) {
  const auto blocks = [&](const LogFault& fault) {
    return fault.fatal || (verdict == "clean" && !fault.kind->is_effect);
  };
  return std::ranges::any_of(faults, blocks) ? "unexplained" : verdict;
}

void AddLogFaults(const std::vector<LogFault>& faults, Diagnosis* diagnosis) {
  for (const LogFault& fault : faults) diagnosis->log_faults.push_back(fault.text);
  diagnosis->verdict = VerdictWith(faults, diagnosis->verdict);
  if (diagnosis->in_model.empty() || std::ranges::none_of(faults, &LogFault::fatal)) return;
  // What was fitted to a wrong log is no model of the next flight.
  diagnosis->in_model.clear();
  for (DescribedTerm& term : diagnosis->open.described) term.in_model = false;
  diagnosis->model_lacks = "all causes and terms, since a fault of the log is fatal";
}

void LeaveOutFaultyFlights(std::vector<FlightLog>* logs, std::vector<LogFault>* faults) {
  std::vector<std::string>& warnings = logs->front().warnings;
  const auto is_fatal = [&](const FlightLog& log) {
    return std::ranges::any_of(
        *faults, [&](const LogFault& fault) { return fault.fatal && fault.log == log.directory; });
  };
  const std::vector<std::string> further = WarningsByFlight(std::span(*logs).subspan(1));
  warnings.insert(warnings.end(), further.begin(), further.end());
  for (std::size_t i = logs->size(); i-- > 1;) {
    const FlightLog& log = (*logs)[i];
    if (!is_fatal(log)) continue;
    warnings.push_back(log.directory + ": has a fatal fault and is left out; correct it");
    EraseAt(i, logs);
  }
  std::erase_if(*faults,
                [&](const LogFault& fault) { return fault.log != logs->front().directory; });
}

}  // namespace trueline
