#include "problems/log/imu_health.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kGapSteps = 5.0;       // median steps that make a gap
constexpr std::size_t kClippedRun = 5;  // equal extreme values in a row that count as saturation
constexpr double kHeldShare = 0.1;      // of samples near the extreme: more is a coarse signal
constexpr double kClippedShare = 0.05;  // of all samples at most: more is a stuck sensor

Episodes GapsOf(const std::vector<ImuSample>& imu, double median_step) {
  Episodes gaps;
  for (std::size_t i = 1; i < imu.size(); ++i) {
    if (SecondsBetween(imu[i - 1].t, imu[i].t) > kGapSteps * median_step) {
      gaps.Add(imu[i - 1].t, imu[i].t);
    }
  }
  return gaps;
}

// Runs of at least kClippedRun samples of the value `extreme`.
Episodes RunsAt(const std::vector<ImuSample>& imu, std::size_t axis, double extreme) {
  Episodes runs;
  for (std::size_t begin = 0; begin < imu.size();) {
    std::size_t end = begin;
    while (end < imu.size() && AxisValue(imu[end], axis) == extreme) ++end;
    if (end - begin >= kClippedRun) runs.Add(imu[begin].t, imu[end - 1].t);
    begin = std::max(end, begin + 1);
  }
  return runs;
}

// Share of the samples within a tenth of the range of an extreme that stay at their value for as
// long as a clipped run. A smooth signal in coarse steps does so at any value, not at the extreme
// alone.
double ShareOfHeld(const std::vector<ImuSample>& imu, std::size_t axis, double extreme,
                   double range) {
  double near = 0.0, held = 0.0;
  for (std::size_t begin = 0; begin < imu.size();) {
    const double value = AxisValue(imu[begin], axis);
    std::size_t end = begin + 1;
    while (end < imu.size() && AxisValue(imu[end], axis) == value) ++end;
    const double off = std::abs(value - extreme);
    if (off > 0.0 && off < 0.1 * range) {
      near += static_cast<double>(end - begin);
      if (end - begin >= kClippedRun) held += static_cast<double>(end - begin);
    }
    begin = end;
  }
  return near > 0.0 ? held / near : 0.0;
}

}  // namespace

double AxisValue(const ImuSample& sample, std::size_t axis) {
  return axis < 3 ? sample.accel[static_cast<Eigen::Index>(axis)]
                  : sample.gyro[static_cast<Eigen::Index>(axis - 3)];
}

void Episodes::Add(TimeNs from, TimeNs to) {
  const double span = SecondsBetween(from, to);
  if (count++ == 0) first = ToSeconds(from);
  duration += span;
  longest = std::max(longest, span);
}

std::vector<Saturation> ImuSaturations(const std::vector<ImuSample>& imu) {
  std::vector<Saturation> saturations;
  if (imu.size() < 2) return saturations;
  const double most = kClippedShare * SecondsBetween(imu.front().t, imu.back().t);
  for (std::size_t axis = 0; axis < kImuAxes.size(); ++axis) {
    const auto less = [axis](const ImuSample& a, const ImuSample& b) {
      return AxisValue(a, axis) < AxisValue(b, axis);
    };
    const auto [low, high] = std::minmax_element(imu.begin(), imu.end(), less);
    if (AxisValue(*low, axis) == AxisValue(*high, axis)) continue;
    for (const double extreme : {AxisValue(*low, axis), AxisValue(*high, axis)}) {
      const Episodes runs = RunsAt(imu, axis, extreme);
      if (runs.count == 0 || runs.duration > most) continue;
      const double range = AxisValue(*high, axis) - AxisValue(*low, axis);
      if (ShareOfHeld(imu, axis, extreme, range) > kHeldShare) continue;
      saturations.push_back({kImuAxes[axis], extreme, runs});
    }
  }
  return saturations;
}

std::vector<std::string> ImuWarnings(const std::vector<ImuSample>& imu) {
  std::vector<std::string> warnings;
  if (imu.size() < 2) return warnings;
  const double median_step = MedianStep(imu);
  const Episodes gaps = GapsOf(imu, median_step);
  if (gaps.count > 0) {
    warnings.push_back(fmt::format(
        "imu: {} gaps longer than {:.1f} ms, {:.3f} s in all, the longest {:.3f} s, the first at "
        "{:.3f} s",
        gaps.count, 1e3 * kGapSteps * median_step, gaps.duration, gaps.longest, gaps.first));
  }
  for (const Saturation& at : ImuSaturations(imu)) {
    warnings.push_back(
        fmt::format("imu: {} is saturated at {:.4g} {} times, {:.3f} s in all, first at {:.3f} s",
                    at.axis, at.at, at.episodes.count, at.episodes.duration, at.episodes.first));
  }
  return warnings;
}

}  // namespace trueline
