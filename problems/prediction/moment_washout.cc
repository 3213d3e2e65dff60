#include "problems/prediction/moment_washout.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace trueline {
namespace {

constexpr double kShortest = 0.02, kLongest = 10.0;  // s, of the washout
constexpr double kLeastLag = 1e-4, kLongestLag = 0.1;

// First-order low-pass of each row of `values`, from its first value on.
LevelMoments LowPassed(const LevelMoments& values, const Eigen::VectorXd& t, double time) {
  LevelMoments low = values;
  for (Eigen::Index i = 1; i < values.cols(); ++i) {
    const double decay = std::exp(-std::max(0.0, t[i] - t[i - 1]) / time);
    low.col(i) = decay * low.col(i - 1) + (1.0 - decay) * values.col(i);
  }
  return low;
}

// Sum of squares that shares of the washed moments leave.
double Misfit(const MomentWashout& washout, const std::vector<MomentRecord>& flights) {
  Eigen::Array2d with = Eigen::Array2d::Zero(), square = with, whole = with;
  for (const MomentRecord& flight : flights) {
    const LevelMoments washed = washout.Of(flight.modelled, flight.t);
    with += flight.measured.cwiseProduct(washed).rowwise().sum().array();
    square += washed.rowwise().squaredNorm().array();
    whole += flight.measured.rowwise().squaredNorm().array();
  }
  return (whole - with.square() / square.max(1e-300)).sum();
}

}  // namespace

LevelMoments MomentWashout::Of(const LevelMoments& moment, const Eigen::VectorXd& t) const {
  LevelMoments washed = lag > kLeastLag ? LowPassed(moment, t, lag) : moment;
  for (int order = 0; order < 2; ++order) washed -= LowPassed(washed, t, washout);
  return washed;
}

MomentWashout FitMomentWashout(const std::vector<MomentRecord>& flights) {
  constexpr double kFirstStep = 0.7, kLeastStep = 0.02;  // of the logarithms
  MomentWashout best;
  double least = Misfit(best, flights);
  for (double step = kFirstStep; step > kLeastStep;) {
    bool moved = false;
    for (const auto& [washout, lag] : {std::array{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const MomentWashout trial{
          std::clamp(best.washout * std::exp(washout * step), kShortest, kLongest),
          std::clamp(best.lag * std::exp(lag * step), kLeastLag, kLongestLag)};
      const double misfit = Misfit(trial, flights);
      if (misfit >= least) continue;
      least = misfit;
      best = trial;
      moved = true;
    }
    if (!moved) step *= 0.5;
  }
  return best;
}

double ShareOf(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& modelled) {
  const double square = modelled.squaredNorm();
  return square > 0.0 ? measured.cwiseProduct(modelled).sum() / square : 1.0;
}

}  // namespace trueline
