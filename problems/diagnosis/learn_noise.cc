#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "problems/diagnosis/base_fit.h"

namespace trueline {
namespace {

// One strength and its prior: the median and the spread of its logarithm.
struct Coordinate {
  double NoiseStrengths::*member = nullptr;
  double ProcessNoise::*process = nullptr;
  double usual, spread;
  double least = 0.0;  // floor: no model is more exact
  double most = 1e9;   // beyond it is an effect's business, not chance's
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

// Normal matrices of the measurements by segment; strengths only scale them.
struct Measurements {
  std::vector<Eigen::MatrixXd> fixes, forces;
  double log_fix_weights = 0.0;
  int fix_rows = 0, force_rows = 0;

  explicit Measurements(const LinearFlight& linear) {
    for (int s = 0; s < static_cast<int>(linear.flight.plan().segments.size()); ++s) {
      const SegmentRows fix = FixStack(linear, s, 1.0), force = ForceStack(linear, s, 1.0);
      fixes.push_back(fix.values.transpose() * fix.values);
      forces.push_back(force.values.transpose() * force.values);
      log_fix_weights += fix.log_weights;
      fix_rows += fix.count();
      force_rows += force.count();
    }
  }
};

double Evidence(const LinearFlight& linear, const Measurements& measured,
                const NoiseStrengths& noise, int nuisances) {
  ChainElimination<kNodeSize> elimination(linear.width());
  double log_weights = measured.log_fix_weights - measured.fix_rows * std::log(noise.fix_scale) -
                       measured.force_rows * std::log(noise.force_sigma);
  const double fix = 1.0 / (noise.fix_scale * noise.fix_scale);
  const double force = 1.0 / (noise.force_sigma * noise.force_sigma);
  const int width = linear.width();
  EliminatedNode<kNodeSize> node;
  Eigen::MatrixXd gram, border = Eigen::MatrixXd::Zero(width, width);
  auto lower = border.selfadjointView<Eigen::Lower>();
  for (int s = 0; s < static_cast<int>(measured.fixes.size()); ++s) {
    gram = fix * measured.fixes[s] + force * measured.forces[s];
    for (const SegmentRows& stack : {LinkStack(linear, s, noise), StartStack(linear, s, noise)}) {
      gram.noalias() += stack.values.transpose() * stack.values;
      log_weights += stack.log_weights;
    }
    elimination.Add(gram, &node);
    border += gram.bottomRightCorner(width, width);
    lower.rankUpdate(node.border.transpose(), -1.0);
  }
  const ReducedSystem reduced({Eigen::MatrixXd(lower)}, BorderPrior(linear), elimination.log_det(),
                              log_weights);
  return reduced.LogEvidence(kThetaSize + nuisances) + LogPrior(noise);
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
  const Measurements measured(linear);
  const auto evidence = [&](const NoiseStrengths& at) {
    return Evidence(linear, measured, at, nuisances);
  };
  const double first = Maximise(evidence, sweeps, noise);
  if (!again_from_ordinary_drift) return first;
  NoiseStrengths ordinary = WithOrdinaryDrift(*noise);
  const double second = Maximise(evidence, sweeps, &ordinary);
  if (second > first) *noise = ordinary;
  return std::max(first, second);
}

}  // namespace trueline
