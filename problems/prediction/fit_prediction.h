// The rotor-driven model fitted to runs by multi-step least squares.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <Eigen/Dense>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/error.h"
#include "problems/effects/effect.h"
#include "problems/prediction/prediction_run.h"
#include "problems/rotor/rotor_vehicle.h"

namespace trueline {

// What is predicted by the rotor drive's model.
struct PredictedVehicle {
  RotorVehicle stated{RotorDrivenModel({}), {}};
  std::vector<Effect> effects;      // as in model.yaml; their sizes are numbers
  std::vector<RotorEffects> units;  // of FittedRotors, one for each size

  FittedRotors Model() const { return {stated.model.rotors(), stated.model.gravity(), units}; }
};

using ProcessNumbers = std::array<StabilisedProcessNumbers, WindowPrediction::kProcesses>;
// The processes' names in files.
inline constexpr std::array<const char*, WindowPrediction::kProcesses> kProcessNames = {"level",
                                                                                        "heading"};
WindowPrediction::Process MakeProcesses(const ProcessNumbers& numbers);
// Of WindowPrediction's numbers.
FusedVelocityNumbers VelocityNumbers(const std::vector<double>& numbers);

struct PredictionSetup {
  PredictedVehicle vehicle;
  std::vector<FittedNumber> numbers;  // of WindowPrediction
  ProcessNumbers processes = {};
  bool learn_processes = true;
  int windows = 600;  // of each trajectory, evenly spaced
  int rounds = 2;     // of vehicle and processes in turns
  int iterations = 12;
};

// By quantity (p, v, R, w) and step.
using QuantitySteps = std::array<std::array<double, PredictionWindow::kSteps>, 4>;
// By chance (kTubeChances); tube.h.
using Tube = std::array<QuantitySteps, 2>;

struct PredictionFit {
  std::vector<double> numbers;  // of WindowPrediction
  // One standard deviation by the spread between runs, and between trajectories where that is more
  // (sandwich with runs or trajectories as clusters); 0 for numbers that are held.
  std::vector<double> sigmas;
  ProcessNumbers processes;
  Tube tube;          // factors on the processes' spread
  double cost = 0.0;  // mean over windows of the scaled errors' sum
  int windows = 0;
  bool converged = false;
};

// The parts of a prediction with a fit's processes and numbers of the state; its addresses stay.
struct PredictionModel {
  FittedRotors rotors;
  WindowPrediction::Process process;
  FusedVelocity velocity;
  FastVelocity fast;
  WindowPrediction prediction;

  PredictionModel(const PredictedVehicle& vehicle, const ProcessNumbers& processes,
                  const std::vector<double>& numbers);
  PredictionModel(const PredictionModel&) = delete;
  PredictionModel& operator=(const PredictionModel&) = delete;
};

// Minimises the sum of the norms of the errors of velocity, attitude and rate over
// horizons and windows. Each trajectory counts alike: its weight is the inverse of its number of
// windows and of its mean change of rate. The processes' numbers are fitted in turns with the
// vehicle's, by the errors of the rates. What relates velocity to position is fitted last, by the
// predicted velocities (FitFusedVelocity).
PredictionFit FitPrediction(const PredictionSetup& setup,
                            const std::vector<const PredictionRun*>& runs, int threads);

// How a run's logged velocity follows from its logged position (room_path.h).

// A window's velocities as a model predicts them, and the way that the logged ones do not explain.
struct WayWindow {
  static constexpr int kEvery = 5, kCompared = FusedVelocity::kSteps / kEvery;  // steps
  std::array<double, 2> v0;                                                     // m/s
  std::array<FusedVelocity::Axis<double>, 2> v;
  // p(h) - p(0) minus the integral of the logged velocity [m].
  Eigen::Matrix<double, 2, kCompared> way;
  int run = 0, trajectory = 0;  // indices
  double weight = 1.0;
};
// `v`: predicted from `row` on.
WayWindow WayOf(const PredictionRun& run, int row,
                const std::array<FusedVelocity::Axis<double>, 2>& v);

struct FusedVelocityFit {
  FusedVelocityNumbers numbers;
  // Of excess, time and lag: by the spread between runs, and between trajectories where that is
  // more.
  std::array<double, 3> sigmas = {};
};

// Minimises over windows and horizons the sum of the norms of what the correction leaves of the
// way. Every trajectory counts alike, by its sum without a correction.
FusedVelocityFit FitFusedVelocity(std::vector<WayWindow> windows, const FusedVelocityNumbers& start,
                                  int threads);

// The numbers of the attitude's processes, from the errors of the rates that they expect.

// The windows that a prediction model is fitted to.
struct TrainingWindow {
  PredictionWindow window;
  WindowTruth truth;
  double weight = 1.0;
  int run = 0;         // index of the run
  int row = 0;         // its start
  int trajectory = 0;  // index of the trajectory
};

// About `count` windows of each trajectory, evenly spaced over its runs. A trajectory's weights sum
// to the same number times the inverse of its mean |w(t + h) - w(t)|; the mean of all weights is 1.
std::vector<TrainingWindow> ChooseWindows(const std::vector<const PredictionRun*>& runs, int count);

// Fits the processes' numbers (not the sizes) to the rates of the windows, for given numbers of the
// vehicle. The model's net accelerations are those under the processes as they come in. A weak
// prior keeps each number within a factor of about e of the setup's. `threads` 0: all cores.
void FitProcesses(const PredictionSetup& setup, const std::vector<double>& numbers,
                  const std::vector<TrainingWindow>& windows, int threads,
                  ProcessNumbers* processes);

// What the fits of the benchmarks' numbers share.

// A residual of the free numbers, differentiated in the scalar that effects are kept for.
template <class Residual>
std::unique_ptr<ceres::CostFunction> CostOf(const Residual& residual, int numbers, int residuals) {
  auto cost =
      std::make_unique<ceres::DynamicAutoDiffCostFunction<Residual, 4>>(new Residual(residual));
  cost->AddParameterBlock(numbers);
  cost->SetNumResiduals(residuals);
  return cost;
}

// Solves in silence. Throws InputError if Ceres gives no usable solution: the start values must not
// pass for a result.
inline ceres::Solver::Summary SolveSilently(ceres::Solver::Options options,
                                            ceres::Problem* problem) {
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem, &summary);
  if (!summary.IsSolutionUsable()) {
    throw InputError("the fit of the numbers failed: " + summary.message +
                     "; are the start values under `numbers` those of such a vehicle?");
  }
  return summary;
}

// Adds the gradient and the curvature of weight * |e|, smooth below `smooth`, where e has the
// Jacobian J.
template <class Error, class Jacobian, class Vector, class Matrix>
void AddNorm(const Error& e, const Jacobian& J, double weight, double smooth, Vector* gradient,
             Matrix* curvature) {
  const double norm = std::hypot(e.norm(), smooth);
  const Vector pull = J.transpose() * e / norm;
  *gradient += weight * pull;
  *curvature += weight / norm * (J.transpose() * J - pull * pull.transpose());
}

// Spread of a fit's numbers by the spread of gradients between clusters (Huber-White sandwich),
// for errors that are correlated within a run or a section of flight.
class ClusterVariance {
 public:
  explicit ClusterVariance(int size) : curvature_(Eigen::MatrixXd::Zero(size, size)) {}

  // Gradient and curvature of the cost of one observation.
  void Add(int cluster, const Eigen::VectorXd& gradient, const Eigen::MatrixXd& curvature) {
    curvature_ += curvature;
    gradients_.try_emplace(cluster, Eigen::VectorXd::Zero(gradient.size())).first->second +=
        gradient;
  }

  // Standard deviation of every number, zero where there is one cluster only; with the small-sample
  // factor n / (n - 1).
  Eigen::VectorXd Sigmas() const {
    const double n = static_cast<double>(gradients_.size());
    Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(curvature_.rows(), curvature_.cols());
    if (n < 2.0) return middle.diagonal();
    for (const auto& [cluster, gradient] : gradients_) middle += gradient * gradient.transpose();
    const Eigen::MatrixXd inverse = curvature_.inverse();
    return (n / (n - 1.0) * inverse * middle * inverse).diagonal().cwiseSqrt();
  }

 private:
  Eigen::MatrixXd curvature_;
  std::map<int, Eigen::VectorXd> gradients_;
};

}  // namespace trueline
