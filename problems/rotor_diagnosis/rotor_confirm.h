// Whether causes of one rotor-driven flight repeat on another of the same vehicle.
#pragma once

#include "problems/rotor_diagnosis/rotor_diagnosis.h"

namespace trueline {

// Adds to each cause its estimate on `log`, as AddRepeats does for the IMU-driven model
// (confirm.h). All causes are fitted to `log` together; each is tested singly. An effect with a
// time of its own (a load that drops) cannot be tested on another flight.
void AddRotorRepeats(const FlightLog& log, const RotorDiagnosisOptions& options,
                     std::vector<Cause>* causes);

}  // namespace trueline
