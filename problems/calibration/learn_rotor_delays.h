// Delays learned from a flight: those that maximise the likelihood of the filter's innovations.
// Rotor sensors, gyroscope and poses have their own clocks and filters, and inertia is the most
// sensitive to that.
#pragma once

#include "problems/rotor/rotor_ekf.h"

namespace trueline {

// The delay (s) of the rotor speeds, within 40 ms. It adds to the one that MakeRotorData applied to
// `data`.
double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options);

// The age (s) of the gyroscope's readings at their stamps, within 40 ms of `centre`. A low-pass
// delays slow motion alike at all frequencies, so the age stands for the filter too. Readings are
// tried at whole samples, because a mean of two has less noise and would be preferred.
double LearnGyroDelay(const RotorAeroModel& model, const FlightLog& log, const RotorData& data,
                      const RotorEkfOptions& options, double centre);

}  // namespace trueline
