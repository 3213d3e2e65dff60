// Noise and delays learned from a flight: the sensor sigmas, disturbance densities and delays that
// maximise the likelihood of the filter's innovations. Logs do not state the noise, and intervals
// depend on it. Rotor sensors, gyroscope and poses have their own clocks and filters, and inertia
// is the most sensitive to that.
#pragma once

#include "problems/rotor/rotor_ekf.h"

namespace trueline {

struct LearnedNoise {
  RotorNoise noise;
  RotorConstants point;  // the filter's last linearisation point
  double gain = 0.0;     // of log likelihood, over the noise that it started from
  int runs = 0;          // of the filter
};

// Coordinate search over the logarithms of the values of RotorNoise, each kept within a factor of
// 100 of `stated`; a drift that is not stated is tried, and kept if the likelihood asks for it. The
// constants stay unknown. `first_step` is of the logarithm; use a small one from a start that is
// known to be good.
LearnedNoise LearnRotorNoise(const RotorAeroModel& model, const RotorData& data,
                             const RotorEkfOptions& options, const RotorNoise& stated,
                             double first_step = 1.2);

// The delay (s) of the rotor speeds, within 40 ms. It adds to the one that MakeRotorData applied to
// `data`.
double LearnRotorDelay(const RotorAeroModel& model, const RotorData& data,
                       const RotorEkfOptions& options);

// The age (s) of the gyroscope's readings at their stamps, within 40 ms of `centre`. A low-pass
// delays slow motion alike at all frequencies, so the age stands for the filter too. Readings are
// tried at whole samples, because a mean of two has less noise and would be preferred.
double LearnGyroDelay(const RotorAeroModel& model, const FlightLog& log, const RotorData& data,
                      const RotorEkfOptions& options, double centre);

// Which of noise and delays to learn, and on how much of a flight.
struct RotorLearning {
  bool noise = true;
  bool rotor_delay = false;
  bool gyro_delay = false;
  double seconds = 20.0;   // of flight, from its start
  RotorNoise stated = {};  // the reference of LearnRotorNoise's factor 100
  double first_step = 1.2;
};

// Learns noise, delays, and noise again, because a wrong delay inflates the disturbances. `streams`
// and `filter` give the start and receive the result.
void LearnFromFlight(const RotorAeroModel& model, const FlightLog& log,
                     const RotorLearning& learning, RotorDataOptions* streams,
                     RotorEkfOptions* filter);

}  // namespace trueline
