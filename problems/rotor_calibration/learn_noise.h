// The noise that a flight really has: sensor sigmas and disturbance densities of the greatest
// likelihood of the filter's innovations. Intervals are only as honest as the noise they come from,
// and no log states it.
#pragma once

#include "problems/rotor_ekf/rotor_ekf.h"

namespace trueline {

struct LearnedNoise {
  RotorNoise noise;
  RotorConstants point;  // that the filter ended up linearised at
  double gain = 0.0;     // of log likelihood, over the noise that it started from
  int runs = 0;          // of the filter
};

// Coordinate search on the logarithm of each of the six figures of RotorNoise, each kept within a
// factor of 100 of `stated`. Constants stay unknown meanwhile. `first_step`: of the logarithm;
// smaller where the start is known to be near.
LearnedNoise LearnNoise(const RotorAeroModel& model, const RotorData& data,
                        const RotorEkfOptions& options, const RotorNoise& stated,
                        double first_step = 1.2);

// The delay (s) of the rotor speeds of the greatest likelihood, within +-`range`, to 2.5 ms: clocks
// and filters of rotor sensors and IMU differ, and inertia suffers first. `data` as MakeRotorData
// gives it; the delay is on top of the one it was made with.
double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options, double range);

// Which of them is learned, and on how much of a flight.
struct RotorLearning {
  bool noise = true;
  bool rotor_delay = false;
  double seconds = 20.0;   // of flight, from its start
  RotorNoise stated = {};  // that figures are kept near
  double first_step = 1.2;
};

// Both: noise, delay, and noise again, since with a wrong delay the disturbances look large.
// `streams` and `filter` hold what to start from, and get the result.
void LearnFromFlight(const RotorAeroModel& model, const FlightLog& log,
                     const RotorLearning& learning, RotorDataOptions* streams,
                     RotorEkfOptions* filter);

}  // namespace trueline
