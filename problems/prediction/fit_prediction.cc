#include "problems/prediction/fit_prediction.h"

#include "problems/common/parallel.h"
#include "problems/prediction/fit_fused_velocity.h"
#include "problems/prediction/fit_processes.h"
#include "problems/prediction/number_fit.h"
#include "problems/prediction/tube.h"

namespace trueline {
namespace {

constexpr int kCount = WindowPrediction::kCount;
using PredictionCost =
    ceres::AutoDiffCostFunction<MultiStepResidual, MultiStepResidual::kResiduals, kCount>;
using NumbersVector = Eigen::Matrix<double, kCount, 1>;
using NumbersMatrix = Eigen::Matrix<double, kCount, kCount>;

// Indices of the numbers that windows do not move.
std::vector<int> HeldInWindows(std::vector<PredictionNumber> numbers) {
  for (int i = 0; i < 3; ++i) numbers[WindowPrediction::kVelocity + i].free = false;
  return HeldNumbers(numbers);
}

PredictionModel ModelOf(const PredictionSetup& setup, const PredictionFit& fit) {
  return {setup.vehicle, fit.processes, fit.numbers};
}

MultiStepResidual::Options ResidualOptions(const PredictionSetup& setup, double weight) {
  MultiStepResidual::Options options;
  options.weight = weight;
  for (int i = 0; i < kCount; ++i) options.units[i] = setup.numbers[i].typical;
  return options;
}

void SolveNumbers(const PredictionSetup& setup, const std::vector<TrainingWindow>& windows,
                  int threads, PredictionFit* fit) {
  const PredictionModel model = ModelOf(setup, *fit);
  Eigen::VectorXd x = InUnits(fit->numbers, setup.numbers);
  ceres::Problem problem;
  problem.AddParameterBlock(x.data(), kCount,
                            new ceres::SubsetManifold(kCount, HeldInWindows(setup.numbers)));
  for (const TrainingWindow& w : windows) {
    problem.AddResidualBlock(
        new PredictionCost(new MultiStepResidual(model.prediction, w.window, w.truth,
                                                 ResidualOptions(setup, w.weight))),
        nullptr, x.data());
  }
  problem.SetParameterLowerBound(x.data(), RotorAir::kWakeLag,
                                 0.002 / setup.numbers[RotorAir::kWakeLag].typical);
  ceres::Solver::Options options;
  options.max_num_iterations = setup.iterations;
  options.function_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = CoresFor(threads);
  const ceres::Solver::Summary summary = SolveSilently(options, &problem);
  fit->numbers = FromUnits(x, setup.numbers);
  fit->cost = 2.0 * summary.final_cost / static_cast<double>(windows.size());
  fit->windows = static_cast<int>(windows.size());
  fit->converged = summary.termination_type == ceres::CONVERGENCE;
}

// Gradient and curvature of one window's sum of norms.
void AddWindow(const PredictionModel& model, const PredictionSetup& setup, const NumbersVector& x,
               const TrainingWindow& w, ClusterVariance* by_run, ClusterVariance* by_trajectory) {
  Eigen::Matrix<double, MultiStepResidual::kResiduals, 1> r;
  Eigen::Matrix<double, MultiStepResidual::kResiduals, kCount, Eigen::RowMajor> J;
  MultiStepResidual::Options options = ResidualOptions(setup, w.weight);
  options.norms = false;
  const PredictionCost cost(new MultiStepResidual(model.prediction, w.window, w.truth, options));
  const double* parameters = x.data();
  double* jacobian = J.data();
  cost.Evaluate(&parameters, r.data(), &jacobian);
  NumbersVector gradient = NumbersVector::Zero();
  NumbersMatrix curvature = NumbersMatrix::Zero();
  for (int i = 0; i < MultiStepResidual::kResiduals; i += 3) {
    AddNorm(r.segment<3>(i), J.middleRows<3>(i), 1.0, 0.1 * w.weight, &gradient, &curvature);
  }
  by_run->Add(w.run, gradient, curvature);
  by_trajectory->Add(w.trajectory, gradient, curvature);
}

std::vector<double> Sigmas(const PredictionSetup& setup, const PredictionFit& fit,
                           const std::vector<TrainingWindow>& windows) {
  const PredictionModel model = ModelOf(setup, fit);
  const NumbersVector x = InUnits(fit.numbers, setup.numbers);
  ClusterVariance by_run(kCount), by_trajectory(kCount);
  for (const TrainingWindow& w : windows) AddWindow(model, setup, x, w, &by_run, &by_trajectory);
  const std::vector<int> held = HeldInWindows(setup.numbers);
  const Eigen::VectorXd variance = by_run.Diagonal(held).cwiseMax(by_trajectory.Diagonal(held));
  return FromUnits(variance.cwiseSqrt(), setup.numbers);
}

void FitVelocity(const PredictionSetup& setup, const std::vector<const PredictionRun*>& runs,
                 const std::vector<TrainingWindow>& windows, int threads, PredictionFit* fit) {
  const PredictionModel model = ModelOf(setup, *fit);
  std::vector<WayWindow> ways(windows.size());
  const auto see = [&](int i) {
    const TrainingWindow& w = windows[i];
    PredictedStates<double> states;
    model.prediction.Predict(fit->numbers.data(), w.window, &states);
    ways[i] = WayOf(*runs[w.run], w.row, WindowPrediction::LevelVelocities(states));
    ways[i].run = w.run;
    ways[i].trajectory = w.trajectory;
  };
  ParallelRuns(static_cast<int>(windows.size()), 64, see, threads);
  const FusedVelocityFit velocity =
      FitFusedVelocity(std::move(ways), VelocityNumbers(fit->numbers), threads);
  const std::array<double, 3> values = {velocity.numbers.excess, velocity.numbers.time,
                                        velocity.numbers.lag};
  for (int i = 0; i < 3; ++i) {
    const int number = WindowPrediction::kVelocity + i;
    if (!setup.numbers[number].free) continue;
    fit->numbers[number] = values[i];
    fit->sigmas[number] = velocity.sigmas[i];
  }
}

}  // namespace

const RotorAirInfo& PredictionNumberInfo(int i) {
  return i < RotorAir::kCount ? kRotorAirNumbers[i] : kStateNumbers[i - RotorAir::kCount];
}

WindowPrediction::Process MakeProcesses(const ProcessNumbers& numbers) {
  return {StabilisedProcess(numbers[WindowPrediction::kLevel]),
          StabilisedProcess(numbers[WindowPrediction::kHeading])};
}

FusedVelocityNumbers VelocityNumbers(const std::vector<double>& numbers) {
  const double* first = numbers.data() + WindowPrediction::kVelocity;
  return {first[0], first[1], first[2]};
}

PredictionModel::PredictionModel(const RotorAirVehicle& vehicle, const ProcessNumbers& processes,
                                 const std::vector<double>& numbers)
    : air(vehicle),
      process(MakeProcesses(processes)),
      velocity(VelocityNumbers(numbers)),
      prediction(air, process, velocity, fast) {}

PredictionFit FitPrediction(const PredictionSetup& setup,
                            const std::vector<const PredictionRun*>& runs, int threads) {
  const std::vector<TrainingWindow> windows = ChooseWindows(runs, setup.windows);
  PredictionFit fit;
  fit.processes = setup.processes;
  for (const PredictionNumber& number : setup.numbers) fit.numbers.push_back(number.start);
  for (int round = 0; round < setup.rounds; ++round) {
    SolveNumbers(setup, windows, threads, &fit);
    if (!setup.learn_processes) break;
    FitProcesses(setup, fit.numbers, windows, threads, &fit.processes);
  }
  SolveNumbers(setup, windows, threads, &fit);
  fit.sigmas = Sigmas(setup, fit, windows);
  FitVelocity(setup, runs, windows, threads, &fit);
  fit.tube = LearnTube(ModelOf(setup, fit), fit.numbers, runs, windows, threads);
  return fit;
}

}  // namespace trueline
