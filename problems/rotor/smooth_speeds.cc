#include "problems/rotor/smooth_speeds.h"

#include <Eigen/Dense>
#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>

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

// A speed that walks at random, as does its rate, and its measurement with white noise.
struct Walk {
  double noise;  // (rad/s)^2, variance of a sample
  double speed;  // (rad/s)^2/s
  double rate;   // (rad/s^2)^2/s
};

struct Known {
  Vector2d mean;  // speed (rad/s), rate (rad/s^2)
  Matrix2d cov;
};

Matrix2d Transition(double dt) { return (Matrix2d() << 1.0, dt, 0.0, 1.0).finished(); }

Known Predicted(const Known& before, double dt, const Walk& walk) {
  const Matrix2d next = Transition(dt);
  Matrix2d added;
  added << dt * dt / 3.0, dt / 2.0, dt / 2.0, 1.0;
  added *= walk.rate * dt;
  added(0, 0) += walk.speed * dt;
  return {next * before.mean, next * before.cov * next.transpose() + added};
}

// Calls visit(i, known) after every sample. Returns minus the logarithm of the likelihood.
template <class Visit>
double Filter(const VectorXd& t, const VectorXd& speeds, const Walk& walk, const Visit& visit) {
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
VectorXd Smooth(const VectorXd& t, const VectorXd& speeds, const Walk& walk) {
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
  Walk walk;
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
    double sum = 0.0;
    for (const auto& column : columns.colwise()) {
      sum += LearnWalk(t, column, std::exp(logarithm)).cost;
    }
    return sum;
  };
  const Eigen::Index last = columns.rows() - 1;
  const double most = (columns.bottomRows(last) - columns.topRows(last)).squaredNorm() /
                      static_cast<double>(columns.size());
  return std::exp(
      boost::math::tools::brent_find_minima(cost, std::log(1e-8 * most), std::log(most), kBits)
          .first);
}

MatrixXd ToMatrix(const std::vector<std::vector<double>>& speeds) {
  MatrixXd matrix(speeds.size(), speeds.front().size());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    matrix.row(i) = Eigen::RowVectorXd::Map(speeds[i].data(), matrix.cols());
  }
  return matrix;
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

SmoothedSpeeds SmoothSpeeds(const std::vector<double>& times,
                            const std::vector<std::vector<double>>& speeds) {
  SmoothedSpeeds result{speeds};
  const VectorXd t = VectorXd::Map(times.data(), static_cast<Eigen::Index>(times.size()));
  if (t.size() < kFewest) return result;
  const MatrixXd measured = ToMatrix(speeds), axes = PrincipalComponents(t, measured);
  MatrixXd components = measured * axes;
  const Eigen::Index learn_on = std::min(t.size(), kLearnOn);
  const MatrixXd moving = Moving(components.topRows(learn_on));
  if (moving.cols() == 0) return result;
  const double noise = LearnSampleVariance(t.head(learn_on), moving);
  if (std::sqrt(noise) < kExact * measured.cwiseAbs().mean()) return result;
  for (auto component : components.colwise()) {
    const Walk walk = LearnWalk(t.head(learn_on), component.head(learn_on), noise).walk;
    component = Smooth(t, component, walk);
  }
  const MatrixXd smoothed = components * axes.transpose();
  for (Eigen::Index i = 0; i < smoothed.rows(); ++i) {
    for (Eigen::Index r = 0; r < smoothed.cols(); ++r) result.speeds[i][r] = smoothed(i, r);
  }
  result.sigma = std::sqrt(noise);
  return result;
}

}  // namespace trueline
