#include "problems/prediction/fit_processes.h"

#include <cmath>

#include "problems/common/parallel.h"
#include "problems/prediction/number_fit.h"

namespace trueline {
namespace {

constexpr int kHorizons = static_cast<int>(WindowTruth::kHorizons.size());

// What a process has seen in a window, and the rates that followed.
struct SeenWindow {
  std::vector<std::vector<double>> observed;                             // by axis
  std::vector<std::array<double, WindowTruth::kHorizons.size()>> rates;  // rad/s, by axis
  double weight = 1.0;
};

std::vector<double*> NumbersOf(AttitudeProcessNumbers* n) {
  return {&n->length,   &n->jitter,        &n->jitter_time, &n->constant,
          &n->coloured, &n->coloured_time, &n->white,       &n->growth};
}

// Errors of the rates, and of the numbers' logarithms against their prior's.
class ProcessResidual {
 public:
  ProcessResidual(const std::vector<SeenWindow>& windows, const AttitudeProcessNumbers& prior)
      : windows_(windows), prior_(prior) {}

  int num_numbers() const {
    AttitudeProcessNumbers n = prior_;
    return static_cast<int>(NumbersOf(&n).size());
  }
  int num_residuals() const {
    return num_numbers() +
           kHorizons * static_cast<int>(windows_.size() * windows_.front().observed.size());
  }
  AttitudeProcessNumbers At(const double* logs) const {
    AttitudeProcessNumbers n = prior_;
    const std::vector<double*> numbers = NumbersOf(&n);
    for (std::size_t i = 0; i < numbers.size(); ++i) *numbers[i] *= std::exp(logs[i]);
    return n;
  }

  bool operator()(double const* const* logs, double* residuals) const {
    // A standard deviation of 1 in the logarithm, worth as much as a hundredth of the windows' sum.
    const double prior = std::sqrt(0.01 * static_cast<double>(windows_.size()));
    for (int i = 0; i < num_numbers(); ++i) residuals[i] = prior * logs[0][i];
    const AttitudeProcess process(At(logs[0]));
    const int axes = static_cast<int>(windows_.front().observed.size());
    double* rest = residuals + num_numbers();
    ParallelRuns(static_cast<int>(windows_.size()), 64,
                 [&](int i) { PutErrors(process, windows_[i], rest + i * axes * kHorizons); });
    return true;
  }

 private:
  // e / sqrt(|e|) with e over all axes, as MultiStepResidual.
  static void PutErrors(const AttitudeProcess& process, const SeenWindow& window, double* out) {
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
  AttitudeProcessNumbers prior_;
};

void FitProcess(const std::vector<SeenWindow>& windows, const AttitudeProcessNumbers& prior,
                AttitudeProcessNumbers* numbers) {
  ProcessResidual residual(windows, prior);
  const int count = residual.num_numbers();
  AttitudeProcessNumbers start = *numbers, base = prior;
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
std::vector<SeenWindow> See(const WindowPrediction& prediction, const std::vector<double>& numbers,
                            const std::vector<TrainingWindow>& windows, int first, int last) {
  std::vector<SeenWindow> seen(windows.size());
  ParallelRuns(static_cast<int>(windows.size()), 64, [&](int i) {
    PredictedStates<double> states;
    std::array<std::vector<double>, 3> net;
    prediction.Predict(numbers.data(), windows[i].window, &states, &net);
    seen[i].weight = windows[i].weight;
    for (int a = first; a <= last; ++a) {
      seen[i].observed.push_back(net[a]);
      auto& rates = seen[i].rates.emplace_back();
      for (int h = 0; h < kHorizons; ++h) rates[h] = windows[i].truth.states[h].w[a];
    }
  });
  return seen;
}

}  // namespace

void FitProcesses(const PredictionSetup& setup, const std::vector<double>& numbers,
                  const std::vector<TrainingWindow>& windows, AttitudeProcessNumbers* level,
                  AttitudeProcessNumbers* heading) {
  const RotorAir air(setup.vehicle);
  const WindowPrediction::Process process = {AttitudeProcess(*level), AttitudeProcess(*heading)};
  const WindowPrediction prediction(air, process);
  FitProcess(See(prediction, numbers, windows, 0, 1), setup.level, level);
  FitProcess(See(prediction, numbers, windows, 2, 2), setup.heading, heading);
}

}  // namespace trueline
