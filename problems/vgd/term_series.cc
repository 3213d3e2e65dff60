#include "problems/vgd/term_series.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr double kSeriesStep = 0.02;  // s; samples are averaged over it

// Means over steps; a step without samples takes the one before.
template <class Samples, class Value>
TermSeries MeansOf(const FlightLog& log, const Samples& samples, const Value& value) {
  const TimeNs start = log.imu.front().t;
  const double length = SecondsBetween(start, std::max(log.imu.back().t, samples.back().t));
  const auto count = static_cast<std::size_t>(std::max(0.0, length) / kSeriesStep) + 1;
  TermSeries series{0.5 * kSeriesStep, kSeriesStep, std::vector<double>(count, 0.0)};
  std::vector<int> taken(count, 0);
  for (const auto& sample : samples) {
    const double t = SecondsBetween(start, sample.t);
    const auto i = std::min(count - 1, static_cast<std::size_t>(std::max(0.0, t) / kSeriesStep));
    series.values[i] += value(sample);
    ++taken[i];
  }
  double last = value(samples.front());
  for (std::size_t i = 0; i < count; ++i) {
    if (taken[i] > 0) last = series.values[i] / taken[i];
    series.values[i] = last;
  }
  return series;
}

void LowPass(double lag, TermSeries* series) {
  if (!(lag > 0.0)) return;
  const double share = -std::expm1(-series->step / lag);
  double y = series->values.front();
  for (double& value : series->values) value = y += share * (value - y);
}

}  // namespace

TermSeries SeriesOf(const FlightLog& log, TermQuantity quantity, double lag) {
  TermSeries series;
  if (quantity == TermQuantity::kVoltage) {
    if (log.battery.empty()) {
      throw ErrorAt(log.directory + "/battery.csv", 0,
                    "a term of the model goes with voltage: log it, or take the term out");
    }
    series = MeansOf(log, log.battery, [](const ScalarSample& s) { return s.value; });
  } else if (quantity == TermQuantity::kThrust) {
    series = MeansOf(log, log.imu, [](const ImuSample& s) { return -s.accel.z(); });
  } else {
    const int axis = static_cast<int>(quantity) - static_cast<int>(TermQuantity::kRateX);
    series = MeansOf(log, log.imu, [axis](const ImuSample& s) { return s.gyro[axis]; });
  }
  LowPass(lag, &series);
  return series;
}

void BindTerms(const FlightLog& log, std::vector<TermFactor>* factors) {
  for (TermFactor& factor : *factors) {
    if (!factor.NeedsSeries()) continue;
    TermSeries series = SeriesOf(log, factor.of, factor.lag);
    const double offset = factor.at.empty() ? 0.0 : factor.at.front();
    for (double& value : series.values) value -= offset;
    factor.series = std::make_shared<TermSeries>(std::move(series));
  }
}

void BindTerms(const FlightLog& log, std::vector<SizedTerm>* terms) {
  for (SizedTerm& term : *terms) BindTerms(log, &term.with);
}

void BindTerms(const FlightLog& log, ForceEffects* effects) {
  if (effects->terms.empty()) return;
  BindTerms(log, &effects->terms);
  using enum TermQuantity;
  const TermQuantity rates[] = {kRateX, kRateY, kRateZ};
  for (int i = 0; i < 3; ++i) {
    effects->rates[i] = std::make_shared<TermSeries>(SeriesOf(log, rates[i], 0.0));
  }
}

}  // namespace trueline
