#include "problems/prediction/training_windows.h"

#include <algorithm>
#include <map>

namespace trueline {
namespace {

struct TrajectorySums {
  int windows = 0, index = 0;
  double change = 0.0;  // rad/s, summed over its windows
};

double ChangeOfRate(const TrainingWindow& window) {
  double sum = 0.0;
  for (const WindowTruth::State& state : window.truth.states) {
    sum += (state.w - window.window.w).norm();
  }
  return sum / static_cast<double>(window.truth.states.size());
}

}  // namespace

std::vector<TrainingWindow> ChooseWindows(const std::vector<const PredictionRun*>& runs,
                                          int count) {
  std::map<std::string, int> available;
  for (const PredictionRun* run : runs) available[run->trajectory] += run->num_windows();
  std::map<std::string, TrajectorySums> sums;
  std::vector<TrainingWindow> windows;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const std::string& trajectory = runs[i]->trajectory;
    TrajectorySums& sum =
        sums.try_emplace(trajectory, TrajectorySums{0, static_cast<int>(sums.size()), 0.0})
            .first->second;
    const int stride = std::max(1, available[trajectory] / count);
    for (int row = stride / 2; row < runs[i]->num_windows(); row += stride) {
      windows.push_back({WindowAt(*runs[i], row), TruthAfter(*runs[i], row), 1.0,
                         static_cast<int>(i), sum.index});
      sum.change += ChangeOfRate(windows.back());
      ++sum.windows;
    }
  }
  double total = 0.0;
  for (TrainingWindow& window : windows) {
    total += window.weight = 1.0 / sums[runs[window.run]->trajectory].change;
  }
  for (TrainingWindow& window : windows) {
    window.weight *= static_cast<double>(windows.size()) / total;
  }
  return windows;
}

}  // namespace trueline
