// Noise, vibration and filtering of a sampled signal, from its power spectral density.
#pragma once

#include <vector>

namespace trueline {

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

}  // namespace trueline
