// Each stream by itself: rate, jitter, gaps, repeats, spikes, and for the IMU quantisation, noise,
// vibration and filtering of each axis.
#pragma once

#include <string>
#include <vector>

#include "problems/inspection/finding.h"
#include "problems/inspection/spectrum.h"
#include "problems/log/flight_log.h"

namespace trueline {

struct AxisHealth {
  std::string axis;      // ax, ..., gz
  double quantum = 0.0;  // the least difference between values, if all are multiples of it
  int spikes = 0;
  double largest_spike = 0.0;
  Noise noise;
};

struct StreamHealth {
  std::string stream;
  std::size_t count = 0;
  double rate = 0.0;             // Hz, by the median step
  double jitter = 0.0;           // s, robust standard deviation of the steps
  int gaps = 0;                  // steps longer than 5 median ones
  double longest = 0.0;          // s
  double lost = 0.0;             // s, in all gaps
  double repeats = 0.0;          // share of samples equal to the one before
  int spikes = 0;                // of positions, or of the rotor that has most
  std::vector<AxisHealth> axes;  // of the IMU
};

// Of every stream that is there; findings go to `findings`.
std::vector<StreamHealth> CheckStreams(const FlightLog& log, std::vector<Finding>* findings);

}  // namespace trueline
