#include "problems/trajectory/overtones.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kSlowest = 0.05, kFastest = 1.5;  // Hz

double ToneOf(const Overtones& figure, int axis) {
  return std::clamp(std::abs(figure[axis * kToneUnknowns]), kSlowest, kFastest);
}

// Taylor coefficients at t, up to `order`.
FlatMatrix ExpandOvertones(const Overtones& figure, double t, int order) {
  FlatMatrix c = FlatMatrix::Zero(kFlatOutputs, order + 1);
  for (int i = 0; i < kFlatOutputs; ++i) {
    for (int tone = 1; tone <= kTones; ++tone) {
      const double w = 2.0 * M_PI * tone * ToneOf(figure, i);
      const auto parts = figure.segment<2>(i * kToneUnknowns + 2 * tone - 1);
      double scale = 1.0;  // w^j / j!
      for (int j = 0; j <= order; ++j) {
        const double angle = w * t + 0.5 * M_PI * j;
        c(i, j) += scale * (parts[0] * std::sin(angle) + parts[1] * std::cos(angle));
        scale *= w / (j + 1);
      }
    }
  }
  const double turn = figure[kOvertoneUnknowns - 1];
  c(3, 0) += turn * t;
  c(3, 1) += turn;
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

PiecewisePolynomial OvertonePath(const Overtones& figure, double duration) {
  constexpr int kMatched = 5;
  double fastest = 0.0;
  for (int i = 0; i < kFlatOutputs; ++i) fastest = std::max(fastest, ToneOf(figure, i));
  const int pieces = static_cast<int>(std::ceil(16.0 * std::max(0.25, fastest) * duration));
  std::vector<double> breaks;
  breaks.reserve(pieces + 1);
  for (int i = 0; i <= pieces; ++i) breaks.push_back(i * duration / pieces);
  return PiecewisePolynomial::FromExpansions(
      [&](double t) { return ExpandOvertones(figure, t, kMatched); }, breaks, kMatched);
}

}  // namespace trueline
