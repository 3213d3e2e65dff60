#include "problems/prediction/multi_step_score.h"

#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "problems/common/parallel.h"

namespace trueline {
namespace {

constexpr int kSteps = PredictionWindow::kSteps;

// Sums over the windows of one run.
struct RunSums {
  MultiStepErrors within, concatenated;
  std::array<int, kSteps> partners = {};  // windows that have one, by horizon
};

// The first-step truths of all windows, run after run.
std::vector<Eigen::Matrix<double, 13, 1>> FirstSteps(
    const std::vector<const PredictionRun*>& runs) {
  std::vector<Eigen::Matrix<double, 13, 1>> truths;
  for (const PredictionRun* run : runs) {
    for (int row = 0; row < run->num_windows(); ++row) truths.push_back(run->states.col(row + 1));
  }
  return truths;
}

void Add(const std::array<double, 4>& errors, int step, MultiStepErrors* sums) {
  for (int a = 0; a < 4; ++a) sums->mean[a][step] += errors[a];
}

RunSums SumErrors(const Predictor& predictor, const PredictionRun& run, int first,
                  const std::vector<Eigen::Matrix<double, 13, 1>>& truths) {
  RunSums sums;
  for (int row = 0; row < run.num_windows(); ++row) {
    const WindowStates states = predictor.predict(run, row);
    for (int k = 0; k < kSteps; ++k) {
      const auto own = StateErrors(run.states.col(row + k + 1), states.col(k));
      Add(own, k, &sums.within);
      const std::size_t partner = static_cast<std::size_t>(first + row + k);
      if (partner >= truths.size()) continue;
      const bool same = row + k < run.num_windows();
      Add(same ? own : StateErrors(truths[partner], states.col(k)), k, &sums.concatenated);
      ++sums.partners[k];
    }
  }
  return sums;
}

struct PhysicsState {
  Eigen::Vector3d p, v;
  Eigen::Vector4d q;
};

// Models and constants of the benchmark's repository (Busetto et al. 2026, physics baseline).
PhysicsState PhysicsSlope(const PhysicsState& state, double thrust_per_mass,
                          const Eigen::Vector3d& w, double drag) {
  const Eigen::Vector4d q = state.q.normalized();
  const Eigen::Vector3d lift = RotateByUnit(q, Eigen::Vector3d(0.0, 0.0, thrust_per_mass));
  return {state.v, lift - drag * state.v - Eigen::Vector3d(0.0, 0.0, 9.81), 0.5 * TimesPure(q, w)};
}

PhysicsState Moved(const PhysicsState& state, double t, const PhysicsState& slope) {
  return {state.p + t * slope.p, state.v + t * slope.v, state.q + t * slope.q};
}

}  // namespace

double MultiStepErrors::Sum(int quantity) const {
  return std::accumulate(mean[quantity].begin(), mean[quantity].end(), 0.0);
}

WindowStates StatesOf(const PredictedStates<double>& predicted) {
  WindowStates states;
  for (int k = 0; k < kSteps; ++k) {
    states.col(k) << predicted[k].p, predicted[k].v, predicted[k].q, predicted[k].w;
  }
  return states;
}

std::array<double, 4> StateErrors(const Eigen::Matrix<double, 13, 1>& truth,
                                  const Eigen::Matrix<double, 13, 1>& predicted) {
  const Eigen::Vector4d e =
      HamiltonProduct<double>(Conjugate<double>(truth.segment<4>(6)), predicted.segment<4>(6));
  return {(truth.segment<3>(0) - predicted.segment<3>(0)).norm(),
          (truth.segment<3>(3) - predicted.segment<3>(3)).norm(),
          2.0 * std::atan2(e.tail<3>().norm(), e[0]),
          (truth.segment<3>(10) - predicted.segment<3>(10)).norm()};
}

MultiStepScore Score(const Predictor& predictor, const std::vector<const PredictionRun*>& runs,
                     int threads) {
  const auto truths = FirstSteps(runs);
  std::vector<int> first(runs.size(), 0);
  for (std::size_t i = 1; i < runs.size(); ++i) {
    first[i] = first[i - 1] + runs[i - 1]->num_windows();
  }
  std::vector<RunSums> sums(runs.size());
  ParallelFor(static_cast<int>(runs.size()), threads,
              [&](int i) { sums[i] = SumErrors(predictor, *runs[i], first[i], truths); });
  MultiStepScore score;
  for (int k = 0; k < kSteps; ++k) {
    int partners = 0;
    for (const RunSums& run : sums) partners += run.partners[k];
    for (int a = 0; a < 4; ++a) {
      for (std::size_t i = 0; i < runs.size(); ++i) {
        score.within.mean[a][k] += sums[i].within.mean[a][k] / runs[i]->num_windows() / runs.size();
        score.concatenated.mean[a][k] += sums[i].concatenated.mean[a][k] / partners;
      }
    }
  }
  return score;
}

Predictor NaivePredictor() {
  return {"naive (state held)", [](const PredictionRun& run, int row) -> WindowStates {
            return run.states.col(row).replicate<1, kSteps>();
          }};
}

Predictor PublishedPhysics(double drag) {
  const auto predict = [drag](const PredictionRun& run, int row) {
    constexpr double kMass = 0.045, kThrust = 3.72e-8, kStep = StabilisedProcess::kStep;
    WindowStates states = run.states.col(row).replicate<1, kSteps>();
    PhysicsState x{states.col(0).segment<3>(0), states.col(0).segment<3>(3),
                   states.col(0).segment<4>(6)};
    const Eigen::Vector3d w = states.col(0).segment<3>(10);
    for (int k = 0; k < kSteps; ++k) {
      const double thrust = kThrust * run.speeds.col(row + k).squaredNorm() / kMass;
      const auto slope = [&](const PhysicsState& at) {
        return PhysicsSlope(at, std::min(thrust, 2.0 * 9.81), w, drag);
      };
      const PhysicsState a = slope(x), b = slope(Moved(x, 0.5 * kStep, a)),
                         c = slope(Moved(x, 0.5 * kStep, b)), d = slope(Moved(x, kStep, c));
      x = Moved(Moved(Moved(Moved(x, kStep / 6.0, a), kStep / 3.0, b), kStep / 3.0, c), kStep / 6.0,
                d);
      x.q.normalize();
      states.col(k).head<10>() << x.p, x.v, x.q;
    }
    return states;
  };
  return {drag == 0.0 ? "physics, as published" : fmt::format("physics, drag {} 1/s", drag),
          predict};
}

Predictor VehiclePredictor(const std::string& name, const WindowPrediction& prediction,
                           const std::vector<double>& numbers) {
  return {name, [&prediction, numbers](const PredictionRun& run, int row) {
            PredictedStates<double> predicted;
            prediction.Predict(numbers.data(), WindowAt(run, row), &predicted);
            return StatesOf(predicted);
          }};
}

}  // namespace trueline
