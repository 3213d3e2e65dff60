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

constexpr double kAtEnds = 0.5;  // s, over which the vehicle moves or stands
constexpr double kMoves = 0.3;   // m/s

// Whether the vehicle moves where its mocap begins, or, by reversed iterators, ends.
template <typename Iterator>
bool Moves(Iterator first, Iterator last) {
  const auto later = std::find_if(first, last, [&](const PoseSample& pose) {
    return std::abs(SecondsBetween(first->t, pose.t)) >= kAtEnds;
  });
  if (later == last) return false;
  const double seconds = std::abs(SecondsBetween(first->t, later->t));
  return (later->p_E - first->p_E).norm() > kMoves * seconds;
}

// From the first to the last mocap sample above the height; z points down. A recording that begins
// or ends in flight is kept from its start, or to its end.
Span AirborneSpan(const CutOptions& options, const std::vector<PoseSample>& mocap,
                  const std::string& map_file) {
  const bool begins_in_flight = Moves(mocap.begin(), mocap.end());
  const bool ends_in_flight = Moves(mocap.rbegin(), mocap.rend());
  if (begins_in_flight && ends_in_flight) return {};
  const double ground = (begins_in_flight ? mocap.back() : mocap.front()).p_E.z();
  const auto high = [&](const PoseSample& pose) {
    return ground - pose.p_E.z() > *options.min_height;
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
  Span span;
  if (!begins_in_flight) span.from = first->t + margin;
  if (!ends_in_flight) span.to = last->t - margin;
  return span;
}

}  // namespace

void CutLog(const CutOptions& options, const std::string& map_file, FlightLog* log) {
  if (!options.from && !options.to && !options.min_height) return;
  if (log->imu.empty()) throw ErrorAt(map_file, 0, "'cut' needs the stream 'imu'; remove it");
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
