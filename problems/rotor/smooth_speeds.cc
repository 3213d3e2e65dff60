#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>

#include "problems/common/parallel.h"
#include "problems/rotor/rotor_data.h"

namespace trueline {
namespace {

using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr Eigen::Index kFewest = 20;     // samples to learn from
constexpr Eigen::Index kLearnOn = 4000;  // samples
constexpr double kExact = 1e-3;          // share of noise that biases no moment of inertia by 0.5 %
constexpr double kStill = 1e-6;          // rad/s
constexpr double kManoeuvre = 0.1;       // s
constexpr int kBits = 10;                // of a logarithm that is learned
constexpr double kLeast = 1e-9,
                 kMost = 1e9;  // of what a walk adds between two samples, of the noise's
constexpr int kRounds = 2;
constexpr double kUnknown = 1e6;  // rate's first variance, of the noise's between two samples

struct Known {
  Vector2d mean;  // speed (rad/s), rate (rad/s^2)
  Matrix2d cov;
};

Matrix2d Transition(double dt) { return (Matrix2d() << 1.0, dt, 0.0, 1.0).finished(); }

Known Predicted(const Known& before, double dt, const SpeedWalk& walk) {
  const Matrix2d next = Transition(dt);
  Matrix2d added;
  added << dt * dt / 3.0, dt / 2.0, dt / 2.0, 1.0;
  added *= walk.rate * dt;
  added(0, 0) += walk.speed * dt;
  return {next * before.mean, next * before.cov * next.transpose() + added};
}

// Calls visit(i, known) after every sample. Returns minus the logarithm of the likelihood.
template <class Visit>
double Filter(const VectorXd& t, const VectorXd& speeds, const SpeedWalk& walk,
              const Visit& visit) {
  const double first = t[1] - t[0];
  Known known{{speeds[0], 0.0}, walk.noise * Matrix2d::Identity()};
  known.cov(1, 1) = kUnknown * (walk.noise / (first * first) + walk.rate * first);
  visit(0, known);
  double cost = 0.0;
  for (Eigen::Index i = 1; i < t.size(); ++i) {
    known = Predicted(known, t[i] - t[i - 1], walk);
    const double innovation = speeds[i] - known.mean[0];
    const double variance = known.cov(0, 0) + walk.noise;
    if (i > 1) cost += 0.5 * (innovation * innovation / variance + std::log(variance));
    const Vector2d gain = known.cov.col(0) / variance;
    known.mean += gain * innovation;
    known.cov -= gain * known.cov.row(0);
    visit(i, known);
  }
  return cost;
}

// The speeds' means given all samples (Rauch, Tung and Striebel 1965).
VectorXd Smooth(const VectorXd& t, const VectorXd& speeds, const SpeedWalk& walk) {
  std::vector<Known> known(t.size());
  Filter(t, speeds, walk, [&](Eigen::Index i, const Known& at) { known[i] = at; });
  VectorXd smooth(t.size());
  Vector2d mean = known.back().mean;
  for (Eigen::Index i = t.size() - 1; i > 0; --i) {
    smooth[i] = mean[0];
    const Known& before = known[i - 1];
    const double dt = t[i] - t[i - 1];
    const Known predicted = Predicted(before, dt, walk);
    mean = before.mean + before.cov * Transition(dt).transpose() *
                             predicted.cov.ldlt().solve(mean - predicted.mean);
  }
  smooth[0] = mean[0];
  return smooth;
}

struct Learned {
  SpeedWalk walk;
  double cost;  // minus the logarithm of its likelihood
};

// Walk of the greatest likelihood, given the noise.
Learned LearnWalk(const VectorXd& t, const VectorXd& speeds, double noise) {
  const double step = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  Learned best{{noise, 0.0, 0.0}, 0.0};
  const auto search = [&](double* density, double unit) {
    const auto cost = [&](double logarithm) {
      *density = unit * std::exp(logarithm);
      return Filter(t, speeds, best.walk, [](auto...) {});
    };
    const auto [logarithm, least] =
        boost::math::tools::brent_find_minima(cost, std::log(kLeast), std::log(kMost), kBits);
    *density = unit * std::exp(logarithm);
    best.cost = least;
  };
  for (int round = 0; round < kRounds; ++round) {
    search(&best.walk.rate, noise / std::pow(step, 3));
    search(&best.walk.speed, noise / step);
  }
  return best;
}

// Variance of a sample of the greatest likelihood over all columns.
double LearnSampleVariance(const VectorXd& t, const MatrixXd& columns) {
  const auto cost = [&](double logarithm) {
    VectorXd costs(columns.cols());
    ParallelFor(static_cast<int>(columns.cols()), FreeCores(),
                [&](int k) { costs[k] = LearnWalk(t, columns.col(k), std::exp(logarithm)).cost; });
    return costs.sum();
  };
  const Eigen::Index last = columns.rows() - 1;
  const double most = (columns.bottomRows(last) - columns.topRows(last)).squaredNorm() /
                      static_cast<double>(columns.size());
  return std::exp(
      boost::math::tools::brent_find_minima(cost, std::log(1e-8 * most), std::log(most), kBits)
          .first);
}

// Orthonormal columns: independent noise of the rotors stays independent. Over kManoeuvre the
// speeds change by more than their noise.
MatrixXd PrincipalComponents(const VectorXd& t, const MatrixXd& speeds) {
  const double step = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  const auto most = static_cast<double>(speeds.rows() / 2);
  const auto lag = static_cast<Eigen::Index>(std::clamp(std::round(kManoeuvre / step), 1.0, most));
  const Eigen::Index rows = speeds.rows() - lag;
  const MatrixXd changes = speeds.bottomRows(rows) - speeds.topRows(rows);
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(changes.transpose() * changes).eigenvectors();
}

// Those columns that change.
MatrixXd Moving(const MatrixXd& columns) {
  std::vector<Eigen::Index> moving;
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    if (columns.col(k).maxCoeff() - columns.col(k).minCoeff() > kStill) moving.push_back(k);
  }
  return columns(Eigen::all, moving);
}

}  // namespace

SpeedModel LearnSpeedModel(const std::vector<double>& times, const MatrixXd& speeds) {
  const VectorXd t = VectorXd::Map(times.data(), static_cast<Eigen::Index>(times.size()));
  if (t.size() < kFewest) return {};
  const MatrixXd axes = PrincipalComponents(t, speeds);
  const Eigen::Index learn_on = std::min(t.size(), kLearnOn);
  const MatrixXd components = speeds.topRows(learn_on) * axes, moving = Moving(components);
  if (moving.cols() == 0) return {};
  const double noise = LearnSampleVariance(t.head(learn_on), moving);
  if (std::sqrt(noise) < kExact * speeds.cwiseAbs().mean()) return {};
  SpeedModel model{std::sqrt(noise), axes, {}};
  for (const auto& component : components.colwise()) {
    model.walks.push_back(LearnWalk(t.head(learn_on), component, noise).walk);
  }
  return model;
}

MatrixXd SmoothSpeeds(const std::vector<double>& times, const MatrixXd& speeds,
                      const SpeedModel& model, int again) {
  if (model.sigma == 0.0) return speeds;
  const VectorXd t = VectorXd::Map(times.data(), static_cast<Eigen::Index>(times.size()));
  MatrixXd components = speeds * model.components;
  for (Eigen::Index k = 0; k < components.cols(); ++k) {
    const VectorXd measured = components.col(k);
    const SpeedWalk& walk = model.walks[k];
    components.col(k) = Smooth(t, measured, walk);
    for (int i = 0; i < again; ++i) {
      components.col(k) += Smooth(t, measured - components.col(k), walk);
    }
  }
  return components * model.components.transpose();
}

}  // namespace trueline
