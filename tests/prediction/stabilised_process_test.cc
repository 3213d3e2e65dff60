// The expected rates against limits that are known, and their derivatives.
#include "cost_functions/models/stabilised_process.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <random>

namespace trueline {
namespace {

constexpr int kSteps = StabilisedProcess::kSteps;
using Columns = std::vector<std::vector<double>>;

Columns Observed(double angle, double rate, const std::function<double(double)>& net) {
  std::vector<double> column = {angle, rate};
  for (int k = 0; k < kSteps; ++k) column.push_back(net((k + 0.5) * StabilisedProcess::kStep));
  column.push_back(0.0);  // velocity
  return {column};
}

StabilisedProcessNumbers WithDisturbance(double factor) {
  StabilisedProcessNumbers n;
  n.constant *= factor;
  n.coloured *= factor;
  n.white *= factor;
  return n;
}

// Without disturbances the rates are the integral of what the rotors do.
TEST(StabilisedProcess, IntegratesWhereNothingDisturbs) {
  const StabilisedProcess process(WithDisturbance(1e-3));
  Columns rates;
  process.Expect(Observed(0.0, 0.2, [](double t) { return 3.0 * std::cos(8.0 * t); }), &rates);
  for (const int k : {0, 9, 24, 49}) {
    const double t = (k + 1) * StabilisedProcess::kStep;
    EXPECT_NEAR(rates[0][k], 0.2 + 3.0 / 8.0 * std::sin(8.0 * t), 0.02) << k;
  }
}

// Where disturbances dominate, what the rotors do only answers them: the tilted vehicle comes back.
TEST(StabilisedProcess, ReturnsToLevelWhereDisturbancesDominate) {
  const StabilisedProcess process(WithDisturbance(1e3));
  Columns rates;
  process.Expect(Observed(0.3, 0.0, [](double) { return 10.0; }), &rates);
  EXPECT_LT(rates[0][20], -0.1);
  process.Expect(Observed(-0.3, 0.0, [](double) { return 10.0; }), &rates);
  EXPECT_GT(rates[0][20], 0.1);
}

// A flight stays within a room: a level vehicle that is fast leans against its velocity.
TEST(StabilisedProcess, BrakesWhereItIsFast) {
  StabilisedProcessNumbers numbers = WithDisturbance(1e3);
  numbers.returning = 0.7;
  const auto tilt_after = [](const StabilisedProcess& process, double u) {
    Columns observed = Observed(0.0, 0.0, [](double) { return 0.0; }), rates;
    observed[0].back() = u;
    process.Expect(observed, &rates);
    double tilt = 0.0;
    for (int k = 0; k < kSteps; ++k) tilt += StabilisedProcess::kStep * rates[0][k];
    return tilt;
  };
  EXPECT_LT(tilt_after(StabilisedProcess(numbers), 0.2), -0.01);
  EXPECT_GT(tilt_after(StabilisedProcess(numbers), -0.2), 0.01);
  numbers.returning = 0.0;
  EXPECT_EQ(tilt_after(StabilisedProcess(numbers), 0.2), 0.0);
}

TEST(StabilisedProcess, DerivativesAreThoseOfDifferences) {
  using Jet = ceres::Jet<double, 1>;
  StabilisedProcessNumbers numbers;
  numbers.returning = 0.7;
  const StabilisedProcess process(numbers);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Columns observed = Observed(0.1, 0.5, [&](double) { return 5.0 * normal(random); });
  observed[0].back() = 0.1;
  std::vector<double> direction;
  for (std::size_t k = 0; k < observed[0].size(); ++k) direction.push_back(normal(random));
  std::vector<std::vector<Jet>> jets(1);
  Columns ahead = observed, behind = observed, up, down;
  constexpr double kChange = 1e-5;
  for (std::size_t k = 0; k < direction.size(); ++k) {
    jets[0].emplace_back(observed[0][k]);
    jets[0][k].v[0] = direction[k];
    ahead[0][k] += kChange * direction[k];
    behind[0][k] -= kChange * direction[k];
  }
  std::vector<std::vector<Jet>> rates;
  process.Expect(jets, &rates);
  process.Expect(ahead, &up);
  process.Expect(behind, &down);
  for (int k = 0; k < kSteps; ++k) {
    EXPECT_NEAR(rates[0][k].v[0], (up[0][k] - down[0][k]) / (2.0 * kChange), 1e-6) << k;
  }
}

// One axis of a vehicle that is such a process: the angle by random frequencies of its kernel.
struct DrawnAxis {
  Columns observed;
  std::array<double, kSteps> rates;
};
DrawnAxis Draw(const StabilisedProcessNumbers& n, std::mt19937* random) {
  constexpr int kWaves = 200;
  constexpr double kSeconds = StabilisedProcess::kStep;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * M_PI);
  const auto draw = [&] { return normal(*random); };
  const double size = n.sizes[0], height = size * std::sqrt(2.0 / kWaves);
  std::array<double, kSteps + 1> w = {};
  double angle = 0.0;
  for (int m = 0; m < kWaves; ++m) {
    const double frequency = draw() / n.length, at = phase(*random);
    angle += height * std::cos(at);
    for (int k = 0; k <= kSteps; ++k) {
      w[k] -= height * frequency * std::sin(frequency * k * kSeconds + at);
    }
  }
  const auto next = [&](double last, double sigma, double time) {
    const double memory = std::exp(-kSeconds / time);
    return memory * last + std::sqrt(1.0 - memory * memory) * sigma * draw();
  };
  const double shake = n.jitter * size / n.length,
               grown = std::sqrt(1.0 + std::pow(n.growth * size, 2));
  double jitter = shake * draw(), coloured = n.coloured * draw();
  for (int k = 0; k <= kSteps; ++k, jitter = next(jitter, shake, n.jitter_time)) w[k] += jitter;
  const double constant = n.constant * draw();
  DrawnAxis axis;
  axis.observed = {{angle + 0.03 * draw(), w[0] + 0.01 * draw()}};
  for (int k = 0; k < kSteps; ++k, coloured = next(coloured, n.coloured, n.coloured_time)) {
    axis.rates[k] = w[k + 1];
    axis.observed[0].push_back((w[k + 1] - w[k]) / kSeconds -
                               grown * (constant + coloured + n.white * draw()));
  }
  axis.observed[0].push_back(0.0);
  return axis;
}

TEST(StabilisedProcess, SpreadsAreThoseOfTheErrors) {
  StabilisedProcessNumbers numbers;
  numbers.sizes.fill(0.2);
  const StabilisedProcess process(numbers);
  std::mt19937 random(11);
  constexpr int kDraws = 2000;
  Eigen::Vector2d square = Eigen::Vector2d::Zero(), expected = Eigen::Vector2d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const DrawnAxis axis = Draw(numbers, &random);
    Columns rates;
    process.Expect(axis.observed, &rates);
    double angle = 0.0, last = 0.0, error = 0.0;
    for (int k = 0; k < kSteps; ++k, last = error) {
      error = axis.rates[k] - rates[0][k];
      angle += 0.5 * StabilisedProcess::kStep * (last + error);
    }
    square += Eigen::Vector2d(error, angle).cwiseAbs2();
    expected += process.Spreads(axis.observed)[0][kSteps - 1].head<2>();
  }
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(square[i] / expected[i], 1.0, 0.12) << i;
}

// A manoeuvre beyond all sizes is predicted with as much less certainty.
TEST(StabilisedProcess, SpreadsGrowWithWhatIsObserved) {
  const StabilisedProcess process{StabilisedProcessNumbers{}};
  const auto wave = [](double height) {
    return Observed(0.0, 0.0, [=](double t) { return height * std::cos(20.0 * t); });
  };
  const double usual = process.Spreads(wave(100.0))[0][20][0];
  EXPECT_NEAR(process.Spreads(wave(1000.0))[0][20][0] / usual, 100.0, 10.0);
}

}  // namespace
}  // namespace trueline
