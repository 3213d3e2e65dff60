#include <cmath>
#include <vector>

#include "problems/diagnosis/base_fit.h"

namespace trueline {
namespace {

// One strength, with what is ordinary for it: the median and the spread of its logarithm.
struct Coordinate {
  double NoiseStrengths::*member = nullptr;
  double ProcessNoise::*process = nullptr;
  double usual, spread;

  double& In(NoiseStrengths* noise) const {
    return member != nullptr ? noise->*member : noise->process.*process;
  }
};

const std::vector<Coordinate>& Coordinates() {
  static const std::vector<Coordinate> coordinates = {
      {.member = &NoiseStrengths::fix_scale, .usual = 1.0, .spread = 0.3},
      {.member = &NoiseStrengths::force_sigma, .usual = 0.1, .spread = 1.5},
      {.member = &NoiseStrengths::gust, .usual = 0.08, .spread = 1.2},
      {.member = &NoiseStrengths::gust_memory, .usual = 0.8, .spread = 0.5},
      {.process = &ProcessNoise::acceleration, .usual = 0.03, .spread = 1.2},
      {.process = &ProcessNoise::tilt, .usual = 0.5 * kDegree, .spread = 1.2},
      {.process = &ProcessNoise::heading, .usual = 0.3 * kDegree, .spread = 1.2},
      {.process = &ProcessNoise::memory, .usual = 5.0, .spread = 1.2}};
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

}  // namespace

double LearnNoise(const BaseFlight& flight, const FlightRows& rows, const FlightUnknowns& x,
                  const Eigen::VectorXd& weight, const Columns& columns, int nuisances, int sweeps,
                  NoiseStrengths* noise) {
  const auto evidence = [&](const NoiseStrengths& at) {
    const ChainSystem system(flight, rows, x, weight, columns, at);
    return LogEvidence(system.reduced(), kThetaSize + nuisances) + LogPrior(at);
  };
  const auto& coordinates = Coordinates();
  std::vector<double> step(coordinates.size(), std::log(sweeps > 2 ? 2.0 : 1.3));
  double best = evidence(*noise);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      bool moved = false;
      for (const double direction : {1.0, -1.0}) {  // of the last success
        NoiseStrengths trial = *noise;
        coordinates[i].In(&trial) *= std::exp(direction * step[i]);
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

}  // namespace trueline
