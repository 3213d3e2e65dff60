// Whether what was found on one rotor-driven flight repeats on another of the same vehicle.
#pragma once

#include "problems/rotor_diagnosis/rotor_diagnosis.h"

namespace trueline {

// Adds to each cause how it comes out on `log`, as AddRepeats does for the IMU-driven model
// (confirm.h): all causes are fitted there together, and each is tested alone, once. What happens
// at a time of one flight (a load that drops) can't be tested on another.
void AddRotorRepeats(const FlightLog& log, const RotorDiagnosisOptions& options,
                     std::vector<Cause>* causes);

}  // namespace trueline
