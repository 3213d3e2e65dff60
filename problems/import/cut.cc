#include "problems/import/cut.h"

#include <algorithm>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

struct Span {
  TimeNs from = std::numeric_limits<TimeNs>::min();
  TimeNs to = std::numeric_limits<TimeNs>::max();
};

Span SpanOfTimes(const CutOptions& options, TimeNs start) {
  Span span;
  const TimeNs origin = options.relative_to_start ? start : 0;
  if (options.from) span.from = origin + FromSeconds(*options.from);
  if (options.to) span.to = origin + FromSeconds(*options.to);
  return span;
}

// From the first to the last mocap sample above the height; z points down.
Span AirborneSpan(const CutOptions& options, const std::vector<PoseSample>& mocap,
                  const std::string& map_file) {
  const auto high = [&](const PoseSample& pose) {
    return mocap.front().p_E.z() - pose.p_E.z() > *options.min_height;
  };
  const auto first = std::find_if(mocap.begin(), mocap.end(), high);
  const auto last = std::find_if(mocap.rbegin(), mocap.rend(), high);
  if (first == mocap.end()) {
    throw ErrorAt(map_file, 0,
                  fmt::format("'cut.airborne': mocap never rises {} m above its start; "
                              "lower 'min_height'",
                              *options.min_height));
  }
  const TimeNs margin = FromSeconds(options.margin);
  return {first->t + margin, last->t - margin};
}

}  // namespace

void CutLog(const CutOptions& options, const std::string& map_file, FlightLog* log) {
  Span span = SpanOfTimes(options, log->imu.front().t);
  if (options.min_height) {
    if (log->mocap.empty()) {
      throw ErrorAt(map_file, 0, "'cut.airborne' needs the stream 'mocap'; use 'from' and 'to'");
    }
    const Span airborne = AirborneSpan(options, log->mocap, map_file);
    span = {std::max(span.from, airborne.from), std::min(span.to, airborne.to)};
  }
  const TimeNs start = log->imu.front().t;
  const TimeNs end = log->imu.back().t;
  ForEachStream(*log, [&](const Stream&, auto& samples) {
    std::erase_if(samples, [&](const auto& s) { return s.t < span.from || s.t > span.to; });
  });
  if (log->imu.empty()) {
    throw ErrorAt(map_file, 0,
                  fmt::format("'cut' leaves nothing of the IMU, which lasts from {} s "
                              "to {} s; widen it",
                              TimeText(start), TimeText(end)));
  }
}

}  // namespace trueline
