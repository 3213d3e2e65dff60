// The noise that a flight really has: sensor sigmas and disturbance densities of the greatest
// likelihood of the filter's innovations. Intervals are only as honest as the noise they come from,
// and no log states it.
#pragma once

#include "problems/rotor_ekf/rotor_ekf.h"

namespace trueline {

struct LearnedNoise {
  RotorNoise noise;
  double gain = 0.0;  // of log likelihood, over the noise that it started from
  int runs = 0;       // of the filter
};

// Coordinate search on the logarithm of each of the six figures of RotorNoise, each kept within a
// factor of 1,000 of its start. Constants stay unknown meanwhile.
LearnedNoise LearnNoise(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options);

}  // namespace trueline
