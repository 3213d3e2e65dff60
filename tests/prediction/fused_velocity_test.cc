// A velocity that a filter has made from a path: its numbers are found again, and a correction from
// velocities alone gives the path's way, slow or fast.
#include <gtest/gtest.h>

#include <random>

#include "problems/prediction/fit_prediction.h"

namespace trueline {
namespace {

constexpr FusedVelocityNumbers kNumbers = {.excess = 0.09, .time = 0.7, .lag = 0.015};

struct Swing {
  double frequency, size, phase;  // Hz, m, rad
};

// Position and logged velocity of a sum of swings at the time t [s].
std::pair<double, double> At(const std::vector<Swing>& swings, double t) {
  double p = 0.0, v = 0.0;
  for (const Swing& swing : swings) {
    const double w = 2.0 * M_PI * swing.frequency;
    const std::complex<double> path = std::polar(swing.size, w * t + swing.phase);
    p += path.real();
    v += (std::complex<double>(0.0, w) * FusedVelocity::Response(kNumbers, w) * path).real();
  }
  return {p, v};
}

// 40 s in a room, by random frequencies of the paths' prior.
PredictionRun RunOf(double length, std::mt19937* random) {
  constexpr int kSwings = 40;
  std::normal_distribution<double> frequency(0.0, 1.0 / (2.0 * M_PI * length));
  std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI);
  PredictionRun run;
  run.states.setZero(13, 4000);
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<Swing> swings;
    for (int i = 0; i < kSwings; ++i) {
      swings.push_back({frequency(*random), 0.6 * std::sqrt(2.0 / kSwings), phase(*random)});
    }
    for (Eigen::Index i = 0; i < run.states.cols(); ++i) {
      const auto [p, v] = At(swings, 0.01 * static_cast<double>(i));
      run.states(axis, i) = p;
      run.states(3 + axis, i) = v;
    }
  }
  return run;
}

// Windows whose velocities are predicted without an error.
std::vector<WayWindow> WaysOf(const PredictionRun& run, int run_index, int trajectory) {
  std::vector<WayWindow> windows;
  for (int row = 0; row < run.num_windows(); row += 20) {
    std::array<FusedVelocity::Axis<double>, 2> v;
    for (int a = 0; a < 2; ++a) {
      for (int k = 0; k < FusedVelocity::kSteps; ++k) v[a][k] = run.states(3 + a, row + k + 1);
    }
    windows.push_back(WayOf(run, row, v));
    windows.back().run = run_index;
    windows.back().trajectory = trajectory;
  }
  return windows;
}

TEST(FitFusedVelocity, RecoversNumbersFromWindows) {
  std::vector<WayWindow> windows;
  std::mt19937 random(5);
  for (int i = 0; i < 6; ++i) {
    const auto more = WaysOf(RunOf(0.25 * (1 << (i / 2)), &random), i, i / 2);
    windows.insert(windows.end(), more.begin(), more.end());
  }
  const FusedVelocityFit fit = FitFusedVelocity(windows, {0.05, 1.0, 0.0}, 1);
  EXPECT_NEAR(fit.numbers.excess, kNumbers.excess, 0.003);
  EXPECT_NEAR(fit.numbers.time, kNumbers.time, 0.05);
  EXPECT_NEAR(fit.numbers.lag, kNumbers.lag, 0.001);
  for (const double sigma : fit.sigmas) EXPECT_GT(sigma, 0.0);
}

// Mean error of the way over half a second [m], by a share of the velocity or by the correction, on
// a circle of 0.6 m.
double WayError(double frequency, double share) {
  const FusedVelocity velocity(kNumbers);
  double sum = 0.0;
  constexpr int kStarts = 20;
  for (int start = 0; start < kStarts; ++start) {
    std::array<double, 2> v0, way;
    std::array<FusedVelocity::Axis<double>, 2> v;
    for (int a = 0; a < 2; ++a) {
      const std::vector<Swing> swings = {{frequency, 0.6, 0.5 * M_PI * a + 0.3 * start}};
      double p0, integral = 0.0;
      std::tie(p0, v0[a]) = At(swings, 0.0);
      for (int k = 0; k < FusedVelocity::kSteps; ++k) {
        const auto [p, next] = At(swings, 0.01 * (k + 1));
        integral += 0.005 * ((k > 0 ? v[a][k - 1] : v0[a]) + next);
        v[a][k] = next;
        way[a] = p - p0 - share * integral;
      }
    }
    if (share == 1.0) {
      const auto correction = velocity.Correction(v0, v);
      for (int a = 0; a < 2; ++a) way[a] -= correction[a].back();
    }
    sum += std::hypot(way[0], way[1]) / kStarts;
  }
  return sum;
}

TEST(FusedVelocity, CorrectsSlowAndFastMotion) {
  EXPECT_LT(WayError(0.08, 1.0), 0.3 * WayError(0.08, 0.92));
  EXPECT_LT(WayError(0.4, 1.0), 0.03);
}

TEST(FusedVelocity, CorrectsNothingWithoutExcessAndLag) {
  const FusedVelocity velocity({.excess = 0.0, .time = 1.0, .lag = 0.0});
  FusedVelocity::Axis<double> v;
  v.fill(1.5);
  for (const auto& axis : velocity.Correction<double>({1.0, 2.0}, {v, v})) {
    for (const double moved : axis) EXPECT_NEAR(moved, 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace trueline
