#include <algorithm>
#include <cmath>
#include <map>

#include "problems/common/parallel.h"
#include "problems/prediction/fit_prediction.h"

namespace trueline {
namespace {

using Ways = Eigen::Matrix<double, 2, WayWindow::kCompared>;
constexpr int kCompared = WayWindow::kCompared;
constexpr double kSmoothWay = 0.003;  // m

// Every trajectory's norms sum to the same.
void Weigh(std::vector<WayWindow>* windows) {
  std::map<int, double> sums;
  for (const WayWindow& w : *windows) sums[w.trajectory] += w.way.colwise().norm().sum();
  for (WayWindow& w : *windows) w.weight = 1.0 / std::max(sums[w.trajectory], 1e-9);
}

FusedVelocityNumbers NumbersAt(const double* x) { return {x[0], x[1], x[2]}; }

// What the correction leaves of a window's way [m].
Ways Left(const FusedVelocity& velocity, const WayWindow& w) {
  const auto correction = velocity.Correction(w.v0, w.v);
  Ways left = w.way;
  for (int a = 0; a < 2; ++a) {
    for (int i = 0; i < kCompared; ++i) {
      left(a, i) -= correction[a][WayWindow::kEvery * (i + 1) - 1];
    }
  }
  return left;
}

// e / sqrt(|e|), as MultiStepResidual.
struct WayResidual {
  const std::vector<WayWindow>& windows;
  int threads;

  bool operator()(double const* const* x, double* residuals) const {
    const FusedVelocity velocity(NumbersAt(x[0]));
    const auto put = [&](int i) {
      const WayWindow& w = windows[i];
      Eigen::Map<Ways> out(residuals + 2 * kCompared * i);
      out = std::sqrt(w.weight) * Left(velocity, w);
      for (int h = 0; h < kCompared; ++h) {
        out.col(h) /= std::sqrt(std::hypot(out.col(h).norm() / std::sqrt(w.weight), kSmoothWay));
      }
    };
    ParallelRuns(static_cast<int>(windows.size()), 64, put, threads);
    return true;
  }
};

std::array<double, 3> Sigmas(const std::vector<WayWindow>& windows, const Eigen::Vector3d& x) {
  constexpr std::array<double, 3> kChange = {1e-3, 1e-2, 1e-4};
  std::vector<FusedVelocity> changed;
  for (int i = 0; i < 6; ++i) {
    Eigen::Vector3d at = x;
    at[i / 2] += i % 2 ? -kChange[i / 2] : kChange[i / 2];
    changed.emplace_back(NumbersAt(at.data()));
  }
  const FusedVelocity velocity(NumbersAt(x.data()));
  ClusterVariance by_run(3), by_trajectory(3);
  for (const WayWindow& w : windows) {
    const auto left = Left(velocity, w);
    std::array<Ways, 3> slopes;
    for (int i = 0; i < 3; ++i) {
      slopes[i] = (Left(changed[2 * i], w) - Left(changed[2 * i + 1], w)) / (2.0 * kChange[i]);
    }
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(3);
    Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(3, 3);
    for (int h = 0; h < kCompared; ++h) {
      Eigen::Matrix<double, 2, 3> J;
      for (int i = 0; i < 3; ++i) J.col(i) = slopes[i].col(h);
      AddNorm(left.col(h), J, w.weight, kSmoothWay, &gradient, &curvature);
    }
    by_run.Add(w.run, gradient, curvature);
    by_trajectory.Add(w.trajectory, gradient, curvature);
  }
  const Eigen::Vector3d sigma = by_run.Sigmas().cwiseMax(by_trajectory.Sigmas());
  return {sigma[0], sigma[1], sigma[2]};
}

}  // namespace

WayWindow WayOf(const PredictionRun& run, int row,
                const std::array<FusedVelocity::Axis<double>, 2>& v) {
  const auto first = run.states.col(row);
  WayWindow window{{first[3], first[4]}, v, {}};
  Eigen::Vector2d integral = Eigen::Vector2d::Zero();
  for (int k = 0; k < FusedVelocity::kSteps; ++k) {
    const auto last = run.states.col(row + k), next = run.states.col(row + k + 1);
    integral += 0.5 * kPathStep * (last.segment<2>(3) + next.segment<2>(3));
    if ((k + 1) % WayWindow::kEvery != 0) continue;
    window.way.col(k / WayWindow::kEvery) = next.head<2>() - first.head<2>() - integral;
  }
  return window;
}

FusedVelocityFit FitFusedVelocity(std::vector<WayWindow> windows, const FusedVelocityNumbers& start,
                                  int threads) {
  Weigh(&windows);
  Eigen::Vector3d x(start.excess, start.time, start.lag);
  ceres::NumericDiffOptions steps;
  steps.relative_step_size = 1e-3;
  auto* cost = new ceres::DynamicNumericDiffCostFunction<WayResidual, ceres::CENTRAL>(
      new WayResidual{windows, threads}, ceres::TAKE_OWNERSHIP, steps);
  cost->AddParameterBlock(3);
  cost->SetNumResiduals(2 * kCompared * static_cast<int>(windows.size()));
  ceres::Problem problem;
  problem.AddResidualBlock(cost, nullptr, x.data());
  constexpr std::array<double, 3> kLeast = {-0.3, 0.05, -0.1}, kMost = {0.3, 10.0, 0.1};
  for (int i = 0; i < 3; ++i) {  // a few windows need not show them
    problem.SetParameterLowerBound(x.data(), i, kLeast[i]);
    problem.SetParameterUpperBound(x.data(), i, kMost[i]);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  SolveSilently(options, &problem);
  return {NumbersAt(x.data()), Sigmas(windows, x)};
}

}  // namespace trueline
