#include "problems/prediction/tube.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "problems/common/parallel.h"

namespace trueline {
namespace {

constexpr int kTubeSteps = PredictionWindow::kSteps;

QuantitySteps SpreadOf(const PredictionModel& model,
                       const WindowPrediction::Observed<double>& seen) {
  const auto level = model.process[WindowPrediction::kLevel].Spreads({seen[0], seen[1]});
  const auto heading = model.process[WindowPrediction::kHeading].Spreads({seen[2]});
  const double g = model.air.vehicle().gravity;
  QuantitySteps spread;
  for (int k = 0; k < kTubeSteps; ++k) {
    const Eigen::Vector4d tilt = level[0][k] + level[1][k], all = tilt + heading[0][k];
    const double variances[] = {g * g * tilt[3], g * g * tilt[2], all[1], all[0]};
    for (int a = 0; a < 4; ++a) spread[a][k] = std::sqrt(variances[a]);
  }
  return spread;
}

// Calls visit(a, k, error of quantity a at step k).
template <class Visit>
void ForEachError(const PredictionRun& run, int row, const WindowStates& states, Visit&& visit) {
  for (int k = 0; k < kTubeSteps; ++k) {
    const auto errors = StateErrors(run.states.col(row + k + 1), states.col(k));
    for (int a = 0; a < 4; ++a) visit(a, k, errors[a]);
  }
}

struct WeighedRatio {
  double ratio, weight;
};

// The smallest ratio up to which the weights sum to `chance` of them all.
double WeighedQuantile(std::vector<WeighedRatio> ratios, double chance) {
  std::ranges::sort(ratios, {}, &WeighedRatio::ratio);
  double total = 0.0, sum = 0.0;
  for (const WeighedRatio& r : ratios) total += r.weight;
  for (const WeighedRatio& r : ratios) {
    sum += r.weight;
    if (sum >= chance * total) return r.ratio;
  }
  return ratios.back().ratio;
}

struct SpreadStates {
  WindowStates states;
  QuantitySteps spread;
};
SpreadStates PredictSpread(const PredictionModel& model, const std::vector<double>& numbers,
                           const PredictionRun& run, int row) {
  PredictedStates<double> states;
  WindowPrediction::Observed<double> seen;
  model.prediction.Predict(numbers.data(), WindowAt(run, row), &states, &seen);
  return {StatesOf(states), SpreadOf(model, seen)};
}

}  // namespace

TubedStates PredictTube(const PredictionModel& model, const std::vector<double>& numbers,
                        const Tube& factors, const PredictionRun& run, int row) {
  const auto [states, spread] = PredictSpread(model, numbers, run, row);
  TubedStates tubed{states, factors};
  for (QuantitySteps& radii : tubed.radii) {
    for (int a = 0; a < 4; ++a) {
      for (int k = 0; k < kTubeSteps; ++k) radii[a][k] *= spread[a][k];
    }
  }
  return tubed;
}

Tube LearnTube(const PredictionModel& model, const std::vector<double>& numbers,
               const std::vector<const PredictionRun*>& runs,
               const std::vector<TrainingWindow>& windows, int threads) {
  std::map<int, int> count;  // windows by trajectory
  for (const TrainingWindow& w : windows) ++count[w.trajectory];
  std::vector<QuantitySteps> ratios(windows.size());
  const auto see = [&](int i) {
    const TrainingWindow& w = windows[i];
    const SpreadStates predicted = PredictSpread(model, numbers, *runs[w.run], w.row);
    ForEachError(*runs[w.run], w.row, predicted.states, [&](int a, int k, double error) {
      ratios[i][a][k] = error / predicted.spread[a][k];
    });
  };
  ParallelRuns(static_cast<int>(windows.size()), 64, see, threads);
  Tube factors;
  for (int a = 0; a < 4; ++a) {
    for (int k = 0; k < kTubeSteps; ++k) {
      std::vector<WeighedRatio> weighed;
      for (std::size_t i = 0; i < windows.size(); ++i) {
        weighed.push_back({ratios[i][a][k], 1.0 / count[windows[i].trajectory]});
      }
      for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
        factors[c][a][k] = WeighedQuantile(weighed, kTubeChances[c]);
      }
    }
  }
  return factors;
}

Tube ShareHeld(const PredictionModel& model, const PredictionFit& fit,
               const std::vector<const PredictionRun*>& runs, int threads) {
  std::vector<Tube> held(runs.size());
  int windows = 0;
  for (const PredictionRun* run : runs) windows += run->num_windows();
  ParallelFor(static_cast<int>(runs.size()), threads, [&](int i) {
    for (int row = 0; row < runs[i]->num_windows(); ++row) {
      const TubedStates tubed = PredictTube(model, fit.numbers, fit.tube, *runs[i], row);
      ForEachError(*runs[i], row, tubed.states, [&](int a, int k, double error) {
        for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
          held[i][c][a][k] += error <= tubed.radii[c][a][k] ? 1.0 : 0.0;
        }
      });
    }
  });
  Tube share{};
  for (const Tube& of_run : held) {
    for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
      for (int a = 0; a < 4; ++a) {
        for (int k = 0; k < kTubeSteps; ++k) share[c][a][k] += of_run[c][a][k] / windows;
      }
    }
  }
  return share;
}

}  // namespace trueline
