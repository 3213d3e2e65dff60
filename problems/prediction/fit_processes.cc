#include <algorithm>
#include <cmath>
#include <map>

#include "problems/common/parallel.h"
#include "problems/prediction/fit_prediction.h"

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
                         static_cast<int>(i), row, sum.index});
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

namespace {

constexpr int kHorizons = static_cast<int>(WindowTruth::kHorizons.size());

// What a process has seen in a window, and the rates that followed, without the braking.
struct SeenWindow {
  std::vector<std::vector<double>> observed;                             // by axis
  std::vector<std::array<double, WindowTruth::kHorizons.size()>> rates;  // rad/s, by axis
  double weight = 1.0;
};

// The numbers that are fitted: a process that uses no velocity has none for it.
std::vector<double*> NumbersOf(StabilisedProcessNumbers* n) {
  std::vector<double*> numbers = {&n->length,   &n->jitter,        &n->jitter_time, &n->constant,
                                  &n->coloured, &n->coloured_time, &n->white,       &n->growth};
  if (n->returning > 0.0) {
    numbers.insert(numbers.end(), {&n->returning, &n->return_time, &n->cruise});
  }
  return numbers;
}

// Errors of the rates, and of the numbers' logarithms against their prior's.
class ProcessResidual {
 public:
  ProcessResidual(const std::vector<SeenWindow>& windows, const StabilisedProcessNumbers& prior,
                  int threads)
      : windows_(windows), prior_(prior), threads_(threads) {}

  int num_numbers() const {
    StabilisedProcessNumbers n = prior_;
    return static_cast<int>(NumbersOf(&n).size());
  }
  int num_residuals() const {
    return num_numbers() +
           kHorizons * static_cast<int>(windows_.size() * windows_.front().observed.size());
  }
  StabilisedProcessNumbers At(const double* logs) const {
    StabilisedProcessNumbers n = prior_;
    const std::vector<double*> numbers = NumbersOf(&n);
    for (std::size_t i = 0; i < numbers.size(); ++i) *numbers[i] *= std::exp(logs[i]);
    return n;
  }

  bool operator()(double const* const* logs, double* residuals) const {
    // A standard deviation of 1 in the logarithm, worth as much as a hundredth of the windows' sum.
    const double prior = std::sqrt(0.01 * static_cast<double>(windows_.size()));
    for (int i = 0; i < num_numbers(); ++i) residuals[i] = prior * logs[0][i];
    const StabilisedProcess process(At(logs[0]));
    const int axes = static_cast<int>(windows_.front().observed.size());
    double* rest = residuals + num_numbers();
    ParallelRuns(
        static_cast<int>(windows_.size()), 64,
        [&](int i) { PutErrors(process, windows_[i], rest + i * axes * kHorizons); }, threads_);
    return true;
  }

 private:
  // e / sqrt(|e|) with e over all axes, as MultiStepResidual.
  static void PutErrors(const StabilisedProcess& process, const SeenWindow& window, double* out) {
    constexpr double kSmooth = 0.04;  // rad/s
    std::vector<std::vector<double>> rates;
    process.Expect(window.observed, &rates);
    for (int h = 0; h < kHorizons; ++h) {
      double square = kSmooth * kSmooth;
      for (std::size_t a = 0; a < rates.size(); ++a) {
        const double e = rates[a][WindowTruth::kHorizons[h] - 1] - window.rates[a][h];
        out[a * kHorizons + h] = e;
        square += e * e;
      }
      const double factor = std::sqrt(window.weight / kHorizons) * std::pow(square, -0.25);
      for (std::size_t a = 0; a < rates.size(); ++a) out[a * kHorizons + h] *= factor;
    }
  }

  const std::vector<SeenWindow>& windows_;
  StabilisedProcessNumbers prior_;
  int threads_;
};

void FitProcess(const std::vector<SeenWindow>& windows, const StabilisedProcessNumbers& prior,
                int threads, StabilisedProcessNumbers* numbers) {
  ProcessResidual residual(windows, prior, threads);
  const int count = residual.num_numbers();
  StabilisedProcessNumbers start = *numbers, base = prior;
  std::vector<double> logs(count);
  for (int i = 0; i < count; ++i) {
    logs[i] = std::log(*NumbersOf(&start)[i] / *NumbersOf(&base)[i]);
  }
  ceres::NumericDiffOptions steps;
  steps.relative_step_size = 1e-3;
  auto* cost = new ceres::DynamicNumericDiffCostFunction<ProcessResidual, ceres::FORWARD>(
      &residual, ceres::DO_NOT_TAKE_OWNERSHIP, steps);
  cost->AddParameterBlock(count);
  cost->SetNumResiduals(residual.num_residuals());
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, logs.data());
  for (int i = 0; i < count; ++i) {
    problem.SetParameterLowerBound(logs.data(), i, -3.0);
    problem.SetParameterUpperBound(logs.data(), i, 3.0);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 8;
  options.function_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_QR;
  SolveSilently(options, &problem);
  *numbers = residual.At(logs.data());
}

// What the process of the axes `first` to `last` sees under the vehicle's numbers.
std::vector<SeenWindow> ObservedMoments(const WindowPrediction& prediction,
                                        const std::vector<double>& numbers,
                                        const std::vector<TrainingWindow>& windows, int first,
                                        int last, int threads) {
  std::vector<SeenWindow> seen(windows.size());
  const auto see = [&](int i) {
    PredictedStates<double> states;
    WindowPrediction::Observed<double> net;
    prediction.Predict(numbers.data(), windows[i].window, &states, &net);
    seen[i].weight = windows[i].weight;
    const Eigen::Vector3d speeds = WindowPrediction::TiltedSpeeds(windows[i].window);
    for (int a = first; a <= last; ++a) {
      seen[i].observed.push_back(net[a]);
      auto& rates = seen[i].rates.emplace_back();
      for (int h = 0; h < kHorizons; ++h) {
        const int step = WindowTruth::kHorizons[h] - 1;
        rates[h] = windows[i].truth.states[h].w[a] -
                   numbers[WindowPrediction::kBraking] * WindowPrediction::Braking(speeds, step)[a];
      }
    }
  };
  ParallelRuns(static_cast<int>(windows.size()), 64, see, threads);
  return seen;
}

}  // namespace

void FitProcesses(const PredictionSetup& setup, const std::vector<double>& numbers,
                  const std::vector<TrainingWindow>& windows, int threads,
                  ProcessNumbers* processes) {
  const PredictionModel model(setup.vehicle, *processes, numbers);
  const auto fit = [&](WindowPrediction::ProcessIndex i, int first, int last) {
    FitProcess(ObservedMoments(model.prediction, numbers, windows, first, last, threads),
               setup.processes[i], threads, &(*processes)[i]);
  };
  fit(WindowPrediction::kLevel, 0, 1);
  fit(WindowPrediction::kHeading, 2, 2);
}

}  // namespace trueline
