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
  const double g = model.rotors.gravity();
  QuantitySteps spread;
  for (int k = 0; k < kTubeSteps; ++k) {
    const Eigen::Vector4d tilt = level[0][k] + level[1][k], all = tilt + heading[0][k];
    const double variances[] = {g * g * tilt[3], g * g * tilt[2], all[1], all[0]};
    for (int a = 0; a < 4; ++a) spread[a][k] = std::sqrt(variances[a]);
  }
  return spread;
}

// Calls visit(c, a, k) for every chance, quantity and step.
template <class Visit>
void ForEachPart(Visit&& visit) {
  for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
    for (int a = 0; a < 4; ++a) {
      for (int k = 0; k < kTubeSteps; ++k) visit(c, a, k);
    }
  }
}

// One where the tube holds the flight, zero elsewhere.
Tube Held(const Tube& factors, const QuantitySteps& ratios) {
  Tube held;
  ForEachPart([&](std::size_t c, int a, int k) {
    held[c][a][k] = ratios[a][k] <= factors[c][a][k] ? 1.0 : 0.0;
  });
  return held;
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

}  // namespace

SpreadStates PredictSpread(const PredictionModel& model, const std::vector<double>& numbers,
                           const PredictionRun& run, int row) {
  PredictedStates<double> states;
  WindowPrediction::Observed<double> seen;
  model.prediction.Predict(numbers.data(), WindowAt(run, row), &states, &seen);
  SpreadStates window{StatesOf(states), SpreadOf(model, seen), {}};
  for (int k = 0; k < kTubeSteps; ++k) {
    const auto errors = StateErrors(run.states.col(row + k + 1), window.states.col(k));
    for (int a = 0; a < 4; ++a) window.ratios[a][k] = errors[a] / window.spread[a][k];
  }
  return window;
}

Tube FollowedFactors::Next(int row, const QuantitySteps& ratios) {
  // 1/s of the logarithm; s, after which the gain falls with the square root of time.
  constexpr double kGain = 1.0, kSettled = 2.0;
  for (Window& w : windows_) {
    for (; w.known < std::min(kTubeSteps, row - w.row); ++w.known) {
      for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
        const double chance = kTubeChances[c], sigma = std::sqrt(chance * (1.0 - chance));
        for (int a = 0; a < 4; ++a) {
          const double missed = (chance - w.held[c][a][w.known]) / sigma;
          factors_[c][a][w.known] *= std::exp(w.gain * missed);
        }
      }
    }
  }
  while (!windows_.empty() && windows_.front().known == kTubeSteps) windows_.pop_front();
  constexpr double kStep = StabilisedProcess::kStep;
  const double time = (row - last_row_) * kStep;
  windows_.push_back(
      {row, 0, kGain * time / std::sqrt(1.0 + row * kStep / kSettled), Held(factors_, ratios)});
  last_row_ = row;
  return factors_;
}

Tube LearnTube(const PredictionModel& model, const std::vector<double>& numbers,
               const std::vector<const PredictionRun*>& runs,
               const std::vector<TrainingWindow>& windows, int threads) {
  std::map<int, int> count;  // windows by trajectory
  for (const TrainingWindow& w : windows) ++count[w.trajectory];
  std::vector<QuantitySteps> ratios(windows.size());
  const auto see = [&](int i) {
    ratios[i] = PredictSpread(model, numbers, *runs[windows[i].run], windows[i].row).ratios;
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

TubeShares ShareHeld(const PredictionModel& model, const PredictionFit& fit,
                     const std::vector<const PredictionRun*>& runs, int threads) {
  std::vector<TubeShares> held(runs.size());
  int windows = 0;
  for (const PredictionRun* run : runs) windows += run->num_windows();
  const auto add = [](const Tube& more, double share, Tube* sum) {
    ForEachPart([&](std::size_t c, int a, int k) { (*sum)[c][a][k] += share * more[c][a][k]; });
  };
  ParallelFor(static_cast<int>(runs.size()), threads, [&](int i) {
    FollowedFactors followed(fit.tube);
    for (int row = 0; row < runs[i]->num_windows(); ++row) {
      const QuantitySteps ratios = PredictSpread(model, fit.numbers, *runs[i], row).ratios;
      add(Held(fit.tube, ratios), 1.0, &held[i].learned);
      add(Held(followed.Next(row, ratios), ratios), 1.0, &held[i].followed);
    }
  });
  TubeShares shares;
  for (const TubeShares& of_run : held) {
    add(of_run.learned, 1.0 / windows, &shares.learned);
    add(of_run.followed, 1.0 / windows, &shares.followed);
  }
  return shares;
}

}  // namespace trueline
