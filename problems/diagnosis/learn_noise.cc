#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "problems/common/parallel.h"
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

class Evidence {
 public:
  Evidence(const LinearFlight& linear, int nuisances)
      : flights_(std::min(2, FreeCores()), NoisyFlight(linear)), border_(kThetaSize + nuisances) {}

  double At(const NoiseStrengths& noise) { return At(noise, 0); }

  // The first of at most two trials whose evidence exceeds `best`, which then becomes it. None if
  // neither does. Where two cores are free, both trials are evaluated at once.
  std::optional<NoiseStrengths> FirstBetter(const std::vector<NoiseStrengths>& trials,
                                            double* best) {
    const int at_once = static_cast<int>(flights_.size()), count = static_cast<int>(trials.size());
    for (int from = 0; from < count; from += at_once) {
      const int to = std::min(count, from + at_once);
      std::array<double, 2> values;
      ParallelFor(to - from, at_once, [&](int i) { values[i] = At(trials[from + i], i); });
      for (int i = from; i < to; ++i) {
        if (!(values[i - from] > *best)) continue;
        *best = values[i - from];
        return trials[i];
      }
    }
    return std::nullopt;
  }

 private:
  double At(const NoiseStrengths& noise, int core) {
    return flights_[core].Reduced(noise).LogEvidence(border_) + LogPrior(noise);
  }

  std::vector<NoisyFlight> flights_;  // one for each core
  int border_;
};

// `noise` with the coordinate changed by a factor each way: what lies within its bounds.
std::vector<NoiseStrengths> Neighbours(const Coordinate& coordinate, NoiseStrengths noise,
                                       double log_factor) {
  std::vector<NoiseStrengths> neighbours;
  const double here = coordinate.In(&noise);
  for (const double direction : {1.0, -1.0}) {
    const double there = here * std::exp(direction * log_factor);
    if (there < coordinate.least || there > coordinate.most) continue;
    coordinate.In(&noise) = there;
    neighbours.push_back(noise);
  }
  return neighbours;
}

// The coordinate search from `noise`, which becomes its end. Returns the evidence there.
double Maximise(Evidence* evidence, int sweeps, NoiseStrengths* noise) {
  const auto& coordinates = Coordinates();
  // Of logarithms, first in the direction of the last success.
  std::vector<double> steps(coordinates.size(), std::log(sweeps > 2 ? 2.0 : 1.3));
  double best = evidence->At(*noise);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      const Coordinate& c = coordinates[i];
      auto better = evidence->FirstBetter(Neighbours(c, *noise, steps[i]), &best);
      if (!better) {
        steps[i] *= 0.5;
        continue;
      }
      const bool forward = (c.In(&*better) > c.In(noise)) == (steps[i] > 0.0);
      steps[i] *= forward ? 1.2 : -1.2;
      *noise = *better;
    }
  }
  return best;
}

// A strength of zero has no logarithm to search from.
NoiseStrengths AboveZero(NoiseStrengths noise) {
  constexpr double kLeast = 0.01;  // of the usual strength
  for (const Coordinate& c : Coordinates()) {
    c.In(&noise) = std::max(c.In(&noise), kLeast * c.usual);
  }
  return noise;
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
  Evidence evidence(linear, nuisances);
  *noise = AboveZero(*noise);
  const double first = Maximise(&evidence, sweeps, noise);
  if (!again_from_ordinary_drift) return first;
  NoiseStrengths ordinary = WithOrdinaryDrift(*noise);
  const double second = Maximise(&evidence, sweeps, &ordinary);
  if (second > first) *noise = ordinary;
  return std::max(first, second);
}

}  // namespace trueline
