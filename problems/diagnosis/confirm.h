// Whether causes and terms of one flight repeat on another flight of the same vehicle: each is
// significant there (p < 0.05), has the same sign, and its size is 0.5 to 2 times the first one or
// within 3 sigmas of it; 2 for terms, which are a few of a thousand that were tried.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosed_flight.h"

namespace trueline {

// The further flights of a diagnosis.
class FurtherFlights {
 public:
  // `logs` after the first one, which is diagnosed. All must outlive this object.
  FurtherFlights(const std::vector<FlightLog>& logs, const MakeFlight& make)
      : logs_(logs), make_(make) {}

  // Stores in each cause of the first flight its estimates on the others, where there are any, and
  // whether it is confirmed. All causes are fitted to a flight together; each is tested singly. An
  // effect with a time of its own (a load that drops) cannot be tested on another flight.
  void Confirm(std::vector<Cause>* causes);

  // The same for terms, beside the causes last confirmed. A term of the battery's voltage is not
  // shown by a log without it.
  void Confirm(std::vector<DescribedTerm>* terms);

  // None where all logs fail to be diagnosed; they are read when first needed.
  bool Any() { return !All().empty(); }

  // Why logs can't be diagnosed.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  const std::vector<std::unique_ptr<DiagnosedFlight>>& All();

  const std::vector<FlightLog>& logs_;
  const MakeFlight& make_;
  std::optional<std::vector<std::unique_ptr<DiagnosedFlight>>> flights_;
  std::vector<std::string> warnings_;
};

// A cause is confirmed if it repeats on more than half of the further flights that can test it, and
// is not if it does not. Nothing is said where none can, and of what belongs to one flight (a wind)
// where others lack it.
void JudgeRepeats(std::vector<Cause>* causes);

}  // namespace trueline
