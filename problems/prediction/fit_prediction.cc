#include "problems/prediction/fit_prediction.h"

#include <ceres/ceres.h>

#include <map>

#include "problems/prediction/fit_processes.h"

namespace trueline {
namespace {

constexpr int kCount = WindowPrediction::kCount;
using PredictionCost =
    ceres::AutoDiffCostFunction<MultiStepResidual, MultiStepResidual::kResiduals, kCount>;
using NumbersVector = Eigen::Matrix<double, kCount, 1>;
using NumbersMatrix = Eigen::Matrix<double, kCount, kCount>;

struct PredictionModel {
  RotorAir air;
  WindowPrediction::Process process;
  WindowPrediction prediction;

  PredictionModel(const PredictionSetup& setup, const PredictionFit& fit)
      : air(setup.vehicle),
        process{AttitudeProcess(fit.level), AttitudeProcess(fit.heading)},
        prediction(air, process) {}
};

MultiStepResidual::Options ResidualOptions(const PredictionSetup& setup, double weight) {
  MultiStepResidual::Options options;
  options.weight = weight;
  for (int i = 0; i < kCount; ++i) options.units[i] = setup.numbers[i].typical;
  return options;
}

std::vector<int> HeldNumbers(const PredictionSetup& setup) {
  std::vector<int> held;
  for (int i = 0; i < kCount; ++i) {
    if (!setup.numbers[i].free) held.push_back(i);
  }
  return held;
}

void SolveNumbers(const PredictionSetup& setup, const std::vector<TrainingWindow>& windows,
                  int threads, PredictionFit* fit) {
  const PredictionModel model(setup, *fit);
  NumbersVector x;
  for (int i = 0; i < kCount; ++i) x[i] = fit->numbers[i] / setup.numbers[i].typical;
  ceres::Problem problem;
  problem.AddParameterBlock(x.data(), kCount,
                            new ceres::SubsetManifold(kCount, HeldNumbers(setup)));
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
  options.num_threads = threads;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (int i = 0; i < kCount; ++i) fit->numbers[i] = x[i] * setup.numbers[i].typical;
  fit->cost = 2.0 * summary.final_cost / static_cast<double>(windows.size());
  fit->windows = static_cast<int>(windows.size());
  fit->converged = summary.termination_type == ceres::CONVERGENCE;
}

// Gradients and curvature of the sum of norms at the solution, by cluster.
struct Curvature {
  NumbersMatrix hessian = NumbersMatrix::Zero();
  std::map<int, NumbersVector> by_run, by_trajectory;

  void Add(const TrainingWindow& window, const NumbersVector& gradient, const NumbersMatrix& part) {
    hessian += part;
    by_run.try_emplace(window.run, NumbersVector::Zero()).first->second += gradient;
    by_trajectory.try_emplace(window.trajectory, NumbersVector::Zero()).first->second += gradient;
  }
};

Curvature CurvatureAt(const PredictionSetup& setup, const PredictionFit& fit,
                      const std::vector<TrainingWindow>& windows) {
  const PredictionModel model(setup, fit);
  NumbersVector x;
  for (int i = 0; i < kCount; ++i) x[i] = fit.numbers[i] / setup.numbers[i].typical;
  Curvature sum;
  Eigen::Matrix<double, MultiStepResidual::kResiduals, 1> r;
  Eigen::Matrix<double, MultiStepResidual::kResiduals, kCount, Eigen::RowMajor> J;
  for (const TrainingWindow& w : windows) {
    MultiStepResidual::Options options = ResidualOptions(setup, w.weight);
    options.norms = false;
    const PredictionCost cost(new MultiStepResidual(model.prediction, w.window, w.truth, options));
    const double* parameters = x.data();
    double* jacobian = J.data();
    cost.Evaluate(&parameters, r.data(), &jacobian);
    NumbersVector gradient = NumbersVector::Zero();
    NumbersMatrix hessian = NumbersMatrix::Zero();
    for (int i = 0; i < MultiStepResidual::kResiduals; i += 3) {
      const Eigen::Vector3d e = r.segment<3>(i);
      const auto Je = J.middleRows<3>(i);
      const double norm = std::hypot(e.norm(), 0.1 * w.weight);
      gradient += Je.transpose() * e / norm;
      const Eigen::Matrix3d bend =
          (Eigen::Matrix3d::Identity() - e * e.transpose() / (norm * norm)) / norm;
      hessian += Je.transpose() * bend * Je;
    }
    sum.Add(w, gradient, hessian);
  }
  return sum;
}

// Variances by the spread of the clusters' gradients (Huber-White), with the small-sample factor
// n / (n - 1).
NumbersVector ClusterVariance(const NumbersMatrix& inverse,
                              const std::map<int, NumbersVector>& gradients) {
  const double n = static_cast<double>(gradients.size());
  if (n < 2.0) return NumbersVector::Zero();
  NumbersMatrix middle = NumbersMatrix::Zero();
  for (const auto& [cluster, g] : gradients) middle += g * g.transpose();
  return (n / (n - 1.0) * inverse * middle * inverse).diagonal();
}

std::vector<double> Sigmas(const PredictionSetup& setup, const PredictionFit& fit,
                           const std::vector<TrainingWindow>& windows) {
  Curvature curvature = CurvatureAt(setup, fit, windows);
  for (const int i : HeldNumbers(setup)) {
    curvature.hessian.row(i).setZero();
    curvature.hessian.col(i).setZero();
    curvature.hessian(i, i) = 1.0;
    for (auto* gradients : {&curvature.by_run, &curvature.by_trajectory}) {
      for (auto& [cluster, gradient] : *gradients) gradient[i] = 0.0;
    }
  }
  const NumbersMatrix inverse = curvature.hessian.inverse();
  const NumbersVector variance = ClusterVariance(inverse, curvature.by_run)
                                     .cwiseMax(ClusterVariance(inverse, curvature.by_trajectory));
  std::vector<double> sigmas(kCount);
  for (int i = 0; i < kCount; ++i) sigmas[i] = std::sqrt(variance[i]) * setup.numbers[i].typical;
  return sigmas;
}

}  // namespace

const RotorAirInfo& PredictionNumberInfo(int i) {
  return i < RotorAir::kCount ? kRotorAirNumbers[i] : kStateErrors[i - RotorAir::kCount];
}

PredictionFit FitPrediction(const PredictionSetup& setup,
                            const std::vector<const PredictionRun*>& runs, int threads) {
  const std::vector<TrainingWindow> windows = ChooseWindows(runs, setup.windows);
  PredictionFit fit;
  fit.level = setup.level;
  fit.heading = setup.heading;
  for (const PredictionNumber& number : setup.numbers) fit.numbers.push_back(number.start);
  for (int round = 0; round < setup.rounds; ++round) {
    SolveNumbers(setup, windows, threads, &fit);
    if (!setup.learn_processes) break;
    FitProcesses(setup, fit.numbers, windows, threads, &fit.level, &fit.heading);
  }
  SolveNumbers(setup, windows, threads, &fit);
  fit.sigmas = Sigmas(setup, fit, windows);
  return fit;
}

}  // namespace trueline
