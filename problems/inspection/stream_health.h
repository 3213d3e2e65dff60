// Each stream by itself: rate, jitter, gaps, repeats, spikes, and for the IMU quantisation, noise,
// vibration and filtering of each axis.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/inspection/fault.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Noise, vibration and filtering of a sampled signal, from its power spectral density.

struct Spectrum {
  std::vector<double> frequency;  // Hz
  std::vector<double> density;    // unit^2/Hz
};

// Welch's estimate: Hann windows of up to 512 samples, half overlapping, the mean taken off each.
// Empty for fewer than 64 samples.
Spectrum WelchSpectrum(const std::vector<double>& values, double rate);

struct Noise {
  double density = 0.0;    // unit/sqrt(Hz): the median over the upper half of the band
  double vibration = 0.0;  // unit, rms above 20 Hz
  double peak = 0.0;       // Hz, of the strongest line above 20 Hz; 0 where none stands out
  double cutoff = 0.0;     // Hz, above which the density stays below `quiet`; 0: nowhere
};
// `quiet`: unit/sqrt(Hz), less noise than any sensor of the kind has before a filter.
Noise NoiseOf(const Spectrum& spectrum, double quiet);

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

  // Whether it is measured by a sensor that is slower than its stamps.
  bool IsHeld() const;
};

// Of every stream that is there; findings go to `findings`. `jump`: where a step of the IMU's
// stamps is a jump of its clock and no gap.
std::vector<StreamHealth> CheckStreams(const FlightLog& log, std::optional<TimeNs> jump,
                                       std::vector<Finding>* findings);

}  // namespace trueline
