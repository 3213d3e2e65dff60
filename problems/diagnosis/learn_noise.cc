#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/noisy_flight.h"

namespace trueline {
namespace {

// One strength and its prior: the median and the spread of its logarithm.
struct Coordinate {
  double NoiseStrengths::*member = nullptr;
  double ProcessNoise::*process = nullptr;
  double usual, spread;
  double least = 0.0;  // floor: no model is more exact
  double most = 1e9;   // more is an effect, not noise
  bool drift = false;  // of the attitude

  double& In(NoiseStrengths* noise) const {
    return member != nullptr ? noise->*member : noise->process.*process;
  }
};

const std::vector<Coordinate>& Coordinates() {
  static const std::vector<Coordinate> coordinates = {
      {.member = &NoiseStrengths::fix_scale, .usual = 1.0, .spread = 0.3},
      {.member = &NoiseStrengths::force_sigma, .usual = 0.06, .spread = 1.0, .least = 0.04},
      {.process = &ProcessNoise::gust, .usual = 0.08, .spread = 1.2},
      {.process = &ProcessNoise::gust_memory, .usual = 0.8, .spread = 0.4, .most = 1.6},
      {.process = &ProcessNoise::acceleration, .usual = 0.03, .spread = 1.2},
      {.process = &ProcessNoise::tilt, .usual = 0.5 * kDegree, .spread = 1.2, .drift = true},
      {.process = &ProcessNoise::heading, .usual = 0.3 * kDegree, .spread = 1.2, .drift = true},
      {.process = &ProcessNoise::memory, .usual = 5.0, .spread = 1.2, .drift = true}};
  return coordinates;
}

double LogPrior(NoiseStrengths noise) {
  double sum = 0.0;
  for (const Coordinate& c : Coordinates()) {
    const double z = std::log(c.In(&noise) / c.usual) / c.spread;
    sum -= 0.5 * z * z;
  }
  return sum;
}

using EvidenceOf = std::function<double(const NoiseStrengths&)>;

// The coordinate search from `noise`, which becomes its end. Returns the evidence there.
double Maximise(const EvidenceOf& evidence, int sweeps, NoiseStrengths* noise) {
  const auto& coordinates = Coordinates();
  std::vector<double> step(coordinates.size(), std::log(sweeps > 2 ? 2.0 : 1.3));
  double best = evidence(*noise);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      bool moved = false;
      for (const double direction : {1.0, -1.0}) {  // first the direction of the last success
        NoiseStrengths trial = *noise;
        coordinates[i].In(&trial) *= std::exp(direction * step[i]);
        const double value_there = coordinates[i].In(&trial);
        if (value_there < coordinates[i].least || value_there > coordinates[i].most) continue;
        const double value = evidence(trial);
        if (value <= best) continue;
        best = value;
        *noise = trial;
        moved = true;
        step[i] *= direction;
        break;
      }
      step[i] *= moved ? 1.2 : 0.5;
    }
  }
  return best;
}

NoiseStrengths WithOrdinaryDrift(NoiseStrengths noise) {
  for (const Coordinate& c : Coordinates()) {
    if (c.drift) c.In(&noise) = c.usual;
  }
  return noise;
}

}  // namespace

double LearnNoise(const LinearFlight& linear, int nuisances, int sweeps, NoiseStrengths* noise,
                  bool again_from_ordinary_drift) {
  NoisyFlight flight(linear);
  const auto evidence = [&](const NoiseStrengths& at) {
    return flight.Reduced(at).LogEvidence(kThetaSize + nuisances) + LogPrior(at);
  };
  const double first = Maximise(evidence, sweeps, noise);
  if (!again_from_ordinary_drift) return first;
  NoiseStrengths ordinary = WithOrdinaryDrift(*noise);
  const double second = Maximise(evidence, sweeps, &ordinary);
  if (second > first) *noise = ordinary;
  return std::max(first, second);
}

}  // namespace trueline
