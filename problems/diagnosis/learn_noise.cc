#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "problems/common/parallel.h"
#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/chain_system.h"
#include "problems/diagnosis/linearisation.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/smoother/evidence_maximum.h"

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
  for (const Coordinate& c : Coordinates()) {
    c.In(&noise) = std::max(c.In(&noise), kNegligible * c.usual);
  }
  return noise;
}

NoiseStrengths WithOrdinaryDrift(NoiseStrengths noise) {
  for (const Coordinate& c : Coordinates()) {
    if (c.drift) c.In(&noise) = c.usual;
  }
  return noise;
}

Eigen::VectorXd LogsOf(NoiseStrengths noise) {
  Eigen::VectorXd logs(Coordinates().size());
  for (Eigen::Index i = 0; i < logs.size(); ++i) logs[i] = std::log(Coordinates()[i].In(&noise));
  return logs;
}

NoiseStrengths WithLogs(NoiseStrengths noise, const Eigen::VectorXd& logs) {
  for (Eigen::Index i = 0; i < logs.size(); ++i) {
    const Coordinate& c = Coordinates()[i];
    c.In(&noise) = std::clamp(std::exp(logs[i]), c.least, c.most);
  }
  return noise;
}

// The border unknowns of a flight with these columns, of those of the flight with all.
std::vector<int> BorderOf(const std::vector<int>& columns) {
  std::vector<int> border = ColumnPlaces().Next(kThetaSize);
  for (const int column : columns) border.push_back(kThetaSize + column);
  return border;
}

// Newton steps from the same strengths, each on the parabola of the evidence of some columns.
class NewtonSteps {
 public:
  NewtonSteps(const LinearFlight& linear, int nuisances, const NoiseStrengths& from)
      : linear_(linear),
        border_(kThetaSize + nuisances),
        from_(AboveZero(from)),
        logs_(LogsOf(from_)) {
    const auto offsets = ParabolaOffsets(static_cast<int>(logs_.size()));
    points_.resize(offsets.size());
    const int threads = std::max(1, FreeCores());
    ParallelFor(threads, threads, [&](int thread) {
      NoisyFlight flight(linear_);
      for (std::size_t i = thread; i < offsets.size(); i += threads) {
        points_[i].noise = WithLogs(from_, logs_ + kNearStrength * offsets[i]);
        points_[i].system = flight.Reduced(points_[i].noise);
      }
    });
  }

  LearnedStrengths Of(const std::vector<int>& columns) const {
    const std::vector<int> border = BorderOf(columns);
    std::vector<double> values;
    values.reserve(points_.size());
    for (const Point& p : points_) {
      values.push_back(p.system.Select(border).LogEvidence(border_) + LogPrior(p.noise));
    }
    const EvidenceParabola parabola = ParabolaThrough(values, static_cast<int>(logs_.size()));
    Eigen::VectorXd step = parabola.Step();
    step *= std::min(1.0, kLongest / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
    const Columns own = linear_.columns.Only(columns);
    const LinearFlight linear = linear_.WithColumns(own);
    NoisyFlight flight(linear);
    for (int i = 0; i < kRepeats; ++i, step *= 0.5) {
      const NoiseStrengths noise = WithLogs(from_, logs_ + kNearStrength * step);
      const double value = flight.Reduced(noise).LogEvidence(border_) + LogPrior(noise);
      if (value > parabola.middle) return {noise, value};
    }
    return {from_, parabola.middle};
  }

 private:
  static constexpr double kLongest = 3.0;  // times kNearStrength

  struct Point {
    NoiseStrengths noise;
    ReducedSystem system;
  };

  const LinearFlight& linear_;
  int border_;
  NoiseStrengths from_;
  Eigen::VectorXd logs_;
  std::vector<Point> points_;
};

}  // namespace

double LearnNoise(const LinearFlight& linear, int nuisances, int sweeps, NoiseStrengths* noise) {
  Evidence evidence(linear, nuisances);
  *noise = AboveZero(*noise);
  return Maximise(&evidence, sweeps, noise);
}

std::vector<LearnedStrengths> LearnNoiseOfEach(const LinearFlight& linear, int nuisances,
                                               const std::vector<std::vector<int>>& sets,
                                               const NoiseStrengths& from) {
  std::map<int, int> place;  // of a column in the flight with those of all sets
  for (const std::vector<int>& set : sets) {
    for (const int column : set) place.emplace(column, 0);
  }
  std::vector<int> used;
  for (auto& [column, at] : place) {
    at = static_cast<int>(used.size());
    used.push_back(column);
  }
  const Columns columns = linear.columns.Only(used);
  const LinearFlight together = linear.WithColumns(columns);
  const NewtonSteps here(together, nuisances, from),
      ordinary(together, nuisances, WithOrdinaryDrift(from));
  std::vector<LearnedStrengths> learned(sets.size());
  ParallelFor(static_cast<int>(sets.size()), 0, [&](int k) {
    std::vector<int> places;
    for (const int column : sets[k]) places.push_back(place.at(column));
    learned[k] = here.Of(places);
    const LearnedStrengths other = ordinary.Of(places);
    if (other.evidence > learned[k].evidence) learned[k] = other;
  });
  return learned;
}

}  // namespace trueline
