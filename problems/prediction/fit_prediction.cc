#include "problems/prediction/fit_prediction.h"

#include "problems/common/parallel.h"
#include "problems/prediction/tube.h"

namespace trueline {
namespace {

// The numbers that windows move.
FreeNumbers FreeInWindows(std::vector<FittedNumber> numbers, const std::vector<double>& values) {
  for (int i = 0; i < 3; ++i) numbers[WindowPrediction::kVelocity + i].free = false;
  return {numbers, values};
}

PredictionModel ModelOf(const PredictionSetup& setup, const PredictionFit& fit) {
  return {setup.vehicle, fit.processes, fit.numbers};
}

std::unique_ptr<ceres::CostFunction> CostOf(const PredictionModel& model,
                                            const FreeNumbers& numbers, const TrainingWindow& w,
                                            bool norms) {
  MultiStepResidual::Options options;
  options.weight = w.weight;
  options.norms = norms;
  return CostOf(MultiStepResidual(model.prediction, numbers, w.window, w.truth, options),
                numbers.count(), MultiStepResidual::kResiduals);
}

void SolveNumbers(const PredictionSetup& setup, const std::vector<TrainingWindow>& windows,
                  int threads, PredictionFit* fit) {
  const PredictionModel model = ModelOf(setup, *fit);
  const FreeNumbers numbers = FreeInWindows(setup.numbers, fit->numbers);
  std::vector<double> x = numbers.Start();
  ceres::Problem problem;
  for (const TrainingWindow& w : windows) {
    problem.AddResidualBlock(CostOf(model, numbers, w, true).release(), nullptr, x.data());
  }
  ceres::Solver::Options options;
  options.max_num_iterations = setup.iterations;
  options.function_tolerance = 1e-4;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.num_threads = CoresFor(threads);
  const ceres::Solver::Summary summary = SolveSilently(options, &problem);
  fit->numbers = numbers.At(x.data());
  fit->cost = 2.0 * summary.final_cost / static_cast<double>(windows.size());
  fit->windows = static_cast<int>(windows.size());
  fit->converged = summary.termination_type == ceres::CONVERGENCE;
}

// Gradient and curvature of one window's sum of norms.
void AddWindow(const PredictionModel& model, const FreeNumbers& numbers, const TrainingWindow& w,
               ClusterVariance* by_run, ClusterVariance* by_trajectory) {
  const int n = numbers.count();
  Eigen::Matrix<double, MultiStepResidual::kResiduals, 1> r;
  Eigen::Matrix<double, MultiStepResidual::kResiduals, Eigen::Dynamic, Eigen::RowMajor> J(r.size(),
                                                                                          n);
  const std::vector<double> x = numbers.Start();
  const double* parameters = x.data();
  double* jacobian = J.data();
  CostOf(model, numbers, w, false)->Evaluate(&parameters, r.data(), &jacobian);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < MultiStepResidual::kResiduals; i += 3) {
    AddNorm(r.segment<3>(i), J.middleRows<3>(i), 1.0, 0.1 * w.weight, &gradient, &curvature);
  }
  by_run->Add(w.run, gradient, curvature);
  by_trajectory->Add(w.trajectory, gradient, curvature);
}

std::vector<double> Sigmas(const PredictionSetup& setup, const PredictionFit& fit,
                           const std::vector<TrainingWindow>& windows) {
  const PredictionModel model = ModelOf(setup, fit);
  const FreeNumbers numbers = FreeInWindows(setup.numbers, fit.numbers);
  ClusterVariance by_run(numbers.count()), by_trajectory(numbers.count());
  for (const TrainingWindow& w : windows) AddWindow(model, numbers, w, &by_run, &by_trajectory);
  return numbers.Spread(by_run.Sigmas().cwiseMax(by_trajectory.Sigmas()));
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

WindowPrediction::Process MakeProcesses(const ProcessNumbers& numbers) {
  return {StabilisedProcess(numbers[WindowPrediction::kLevel]),
          StabilisedProcess(numbers[WindowPrediction::kHeading])};
}

FusedVelocityNumbers VelocityNumbers(const std::vector<double>& numbers) {
  const double* first = numbers.data() + WindowPrediction::kVelocity;
  return {first[0], first[1], first[2]};
}

PredictionModel::PredictionModel(const PredictedVehicle& vehicle, const ProcessNumbers& processes,
                                 const std::vector<double>& numbers)
    : rotors(vehicle.Model()),
      process(MakeProcesses(processes)),
      velocity(VelocityNumbers(numbers)),
      prediction(rotors, process, velocity, fast) {}

PredictionFit FitPrediction(const PredictionSetup& setup,
                            const std::vector<const PredictionRun*>& runs, int threads) {
  const std::vector<TrainingWindow> windows = ChooseWindows(runs, setup.windows);
  PredictionFit fit;
  fit.processes = setup.processes;
  for (const FittedNumber& number : setup.numbers) fit.numbers.push_back(number.start);
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
