// Whether causes of one flight repeat on another flight of the same vehicle.
#pragma once

#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/score_test.h"

namespace trueline {

// Adds to each cause of the flight with the log `first` its estimate on `flight`. All causes are
// fitted to it together; each is tested singly. A cause repeats if it is significant (p < 0.05),
// has the same sign, and its size is 0.5 to 2 times the first one or within the sigmas of it. An
// effect with a time of its own (a load that drops) cannot be tested on another flight.
void AddRepeats(const FlightLog& first, DiagnosedFlight* flight, std::vector<Cause>* causes);

// A cause is confirmed if it repeats on more than half of the further flights.
void Confirm(std::vector<Cause>* causes);

}  // namespace trueline
