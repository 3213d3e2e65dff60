// The search for causes that may be named: rounds of tests, each cause judged by its witness, its
// gain on held-out flight and further flights.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "problems/diagnosis/confirm.h"
#include "problems/diagnosis/rounds.h"

namespace trueline {

struct NamedCauses {
  std::unique_ptr<DiagnosedFlight> flight;  // its last Fit has the causes
  Rounds rounds;
  std::vector<Cause> causes;     // false data first, if they are named
  std::vector<Cause> set_aside;  // with the reason
  std::vector<Cause> explained;  // significant without the others; with the reason
  Gains gains;                   // of all causes together
};

// Searches the whole catalogue on `flight`, which is fitted without causes. `false_data`, if any,
// is left out of its data already.
NamedCauses SearchNamedCauses(std::unique_ptr<DiagnosedFlight> flight,
                              const std::optional<Cause>& false_data, const SearchOptions& options,
                              FurtherFlights* others);

}  // namespace trueline
