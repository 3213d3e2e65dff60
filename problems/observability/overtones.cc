#include "problems/observability/overtones.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "cost_functions/numbers/taylor.h"

namespace trueline {
namespace {

constexpr double kSlowest = 0.05, kFastest = 1.5;  // Hz
using MatchedSeries = Taylor<double, kMatchedDerivatives>;

double ToneOf(const Overtones& figure, int axis) {
  return std::clamp(std::abs(figure[axis * kToneUnknowns]), kSlowest, kFastest);
}

// c[0] + c[1] x + ...
MatchedSeries Polynomial(const MatchedSeries& x, std::initializer_list<double> c) {
  MatchedSeries sum(0.0), power(1.0);
  for (const double coefficient : c) {
    sum += MatchedSeries(coefficient) * power;
    power = power * x;
  }
  return sum;
}

// From 0 to 1 over x in [0, 1] with four derivatives of zero at both ends, and its integral.
MatchedSeries Step(const MatchedSeries& x) {
  return Polynomial(x, {0, 0, 0, 0, 0, 126, -420, 540, -315, 70});
}
MatchedSeries StepIntegral(const MatchedSeries& x) {
  return Polynomial(x, {0, 0, 0, 0, 0, 0, 21, -60, 67.5, -35, 7});
}

// The amplitude envelope about t (0 to 1), and its integral since the start.
struct Swell {
  MatchedSeries size, integral;
};
Swell SwellAt(const MatchedSeries& t, double duration, double ramp) {
  if (t[0] < ramp) {
    const MatchedSeries x = t / MatchedSeries(ramp);
    return {Step(x), MatchedSeries(ramp) * StepIntegral(x)};
  }
  if (t[0] > duration - ramp) {
    const MatchedSeries x = (MatchedSeries(duration) - t) / MatchedSeries(ramp);
    return {Step(x), MatchedSeries(duration - ramp) - MatchedSeries(ramp) * StepIntegral(x)};
  }
  return {MatchedSeries(1.0), t - MatchedSeries(0.5 * ramp)};
}

// Taylor coefficients at t.
FlatMatrix ExpandOvertones(const Overtones& figure, double t, double duration, double ramp) {
  const MatchedSeries time = MatchedSeries::Time(t);
  const Swell swell = SwellAt(time, duration, ramp);
  FlatMatrix c(kFlatOutputs, kMatchedDerivatives + 1);
  for (int i = 0; i < kFlatOutputs; ++i) {
    MatchedSeries sum(0.0);
    for (int tone = 1; tone <= kTones; ++tone) {
      const MatchedSeries angle = MatchedSeries(2.0 * M_PI * tone * ToneOf(figure, i)) * time;
      const auto parts = figure.segment<2>(i * kToneUnknowns + 2 * tone - 1);
      sum += MatchedSeries(parts[0]) * sin(angle) + MatchedSeries(parts[1]) * cos(angle);
    }
    sum = sum * swell.size;
    if (i == kFlatOutputs - 1) sum += MatchedSeries(figure[kOvertoneUnknowns - 1]) * swell.integral;
    for (int j = 0; j <= kMatchedDerivatives; ++j) c(i, j) = sum[j];
  }
  return c;
}

}  // namespace

Overtones OvertonesOf(const Lissajous& figure) {
  Overtones x = Overtones::Zero();
  for (int i = 0; i < kFlatOutputs; ++i) {
    x.segment<3>(i * kToneUnknowns) << figure.frequency[i],
        figure.amplitude[i] * std::cos(figure.phase[i]),
        figure.amplitude[i] * std::sin(figure.phase[i]);
  }
  return x;
}

Overtones OvertoneUnits(double size, double yaw_size) {
  constexpr double kFrequency = 0.3, kTurn = 3.0;  // Hz, rad/s
  Overtones unit;
  for (int i = 0; i < kFlatOutputs; ++i) {
    unit[i * kToneUnknowns] = kFrequency;
    for (int tone = 1; tone <= kTones; ++tone) {
      unit.segment<2>(i * kToneUnknowns + 2 * tone - 1)
          .setConstant((i < 3 ? size : yaw_size) / tone);
    }
  }
  unit[kOvertoneUnknowns - 1] = kTurn;
  return unit;
}

PiecewisePolynomial OvertonePath(const Overtones& figure, double duration, double ramp) {
  double fastest = 0.0;
  for (int i = 0; i < kFlatOutputs; ++i) fastest = std::max(fastest, ToneOf(figure, i));
  const int pieces = static_cast<int>(std::ceil(16.0 * std::max(0.25, fastest) * duration));
  return PiecewisePolynomial::FromExpansions(
      [&](double t) { return ExpandOvertones(figure, t, duration, ramp); }, duration, pieces);
}

}  // namespace trueline
