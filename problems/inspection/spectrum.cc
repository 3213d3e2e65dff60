#include "problems/inspection/spectrum.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr std::size_t kLongestWindow = 512;
constexpr std::size_t kShortestWindow = 64;
constexpr double kVibration = 20.0;  // Hz, above which no vehicle's motion lies
constexpr double kLine = 10.0;       // of the density about it, for a line

double MedianOver(const Spectrum& spectrum, double from, double to) {
  std::vector<double> inside;
  for (std::size_t i = 0; i < spectrum.frequency.size(); ++i) {
    if (spectrum.frequency[i] >= from && spectrum.frequency[i] <= to) {
      inside.push_back(spectrum.density[i]);
    }
  }
  return inside.empty() ? 0.0 : LowerMedian(inside);
}

// The uppermost tenth of the band does not count: a sensor's own filter for the sampling ends
// there.
double CutoffOf(const Spectrum& spectrum, double quiet) {
  const double nyquist = spectrum.frequency.back();
  double cutoff = 0.0;
  for (std::size_t i = spectrum.frequency.size(); i-- > 0;) {
    if (spectrum.density[i] >= quiet * quiet) break;
    cutoff = spectrum.frequency[i];
  }
  return cutoff < 0.9 * nyquist ? cutoff : 0.0;
}

}  // namespace

Spectrum WelchSpectrum(const std::vector<double>& values, double rate) {
  std::size_t window = kLongestWindow;
  while (window > values.size()) window /= 2;
  if (window < kShortestWindow) return {};
  Spectrum spectrum;
  spectrum.density.assign(window / 2 + 1, 0.0);
  for (std::size_t k = 0; k <= window / 2; ++k) {
    spectrum.frequency.push_back(static_cast<double>(k) * rate / static_cast<double>(window));
  }
  std::vector<double> hann(window);
  double power = 0.0;
  for (std::size_t i = 0; i < window; ++i) {
    hann[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) /
                                   static_cast<double>(window));
    power += hann[i] * hann[i];
  }
  Eigen::FFT<double> fft;
  std::vector<double> piece(window);
  std::vector<std::complex<double>> transform;
  int pieces = 0;
  for (std::size_t begin = 0; begin + window <= values.size(); begin += window / 2, ++pieces) {
    double mean = 0.0;
    for (std::size_t i = 0; i < window; ++i)
      mean += values[begin + i] / static_cast<double>(window);
    for (std::size_t i = 0; i < window; ++i) piece[i] = hann[i] * (values[begin + i] - mean);
    fft.fwd(transform, piece);
    for (std::size_t k = 0; k <= window / 2; ++k) {
      const double sides = k == 0 || k == window / 2 ? 1.0 : 2.0;
      spectrum.density[k] += sides * std::norm(transform[k]) / (rate * power);
    }
  }
  for (double& d : spectrum.density) d /= pieces;
  return spectrum;
}

Noise NoiseOf(const Spectrum& spectrum, double quiet) {
  Noise noise;
  if (spectrum.frequency.size() < 4) return noise;
  const double nyquist = spectrum.frequency.back(), bin = spectrum.frequency[1];
  noise.density = std::sqrt(MedianOver(spectrum, 0.5 * nyquist, nyquist));
  noise.cutoff = CutoffOf(spectrum, quiet);
  const double floor = MedianOver(spectrum, kVibration, nyquist);
  double highest = kLine * floor;
  for (std::size_t i = 0; i < spectrum.frequency.size(); ++i) {
    if (spectrum.frequency[i] < kVibration) continue;
    noise.vibration += bin * spectrum.density[i];
    if (spectrum.density[i] <= highest || spectrum.frequency[i] < 1.25 * kVibration) continue;
    highest = spectrum.density[i];
    noise.peak = spectrum.frequency[i];
  }
  noise.vibration = std::sqrt(noise.vibration);
  return noise;
}

}  // namespace trueline
