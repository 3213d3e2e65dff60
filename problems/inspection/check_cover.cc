#include <algorithm>
#include <array>
#include <cmath>

#include "problems/import/stamp_reader.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/log/imu_health.h"

namespace trueline {
namespace {

constexpr double kLeastOverlap = 8.0;  // s

std::string SpanOf(TimeNs origin, TimeNs from, TimeNs to) {
  return fmt::format("{:.1f} to {:.1f} s", SecondsBetween(origin, from),
                     SecondsBetween(origin, to));
}

// Returns whether most of the stream lies outside of the IMU's time.
template <class Sample>
bool CheckStreamCover(const FlightLog& log, const std::vector<Sample>& samples, const char* name,
                      Examination* e) {
  if (samples.empty() || log.imu.empty()) return false;
  const TimeNs begin = log.imu.front().t, end = log.imu.back().t;
  const double longest =
      std::max(SecondsBetween(begin, end), SecondsBetween(samples.front().t, samples.back().t));
  if (longest < kLeastOverlap) return false;
  const auto inside = std::count_if(samples.begin(), samples.end(),
                                    [&](const Sample& s) { return s.t >= begin && s.t <= end; });
  const double share = static_cast<double>(inside) / static_cast<double>(samples.size());
  if (share >= kMostly) return false;
  e->Add({&fault::kCover, name, share < 1.0 - kMostly ? Level::kFatal : Level::kBiases, share},
         fmt::format("only {:.0f} % of {}.csv lies within the time of imu.csv ({}): it spans {}",
                     100.0 * share, name, SpanOf(begin, begin, end),
                     SpanOf(begin, samples.front().t, samples.back().t)),
         "export the whole flight, or bring the clocks together (time: offset in the map)");
  return true;
}

// The reverse: the share of the IMU's time that a stream covers. Rest before and after the flight
// is no reason to log less of either; fixes come in passes and are not judged.
template <class Sample>
void CheckImuCover(const FlightLog& log, const std::vector<Sample>& samples, const char* name,
                   double least, Examination* e) {
  if (samples.empty() || log.imu.empty()) return;
  const TimeNs begin = log.imu.front().t, end = log.imu.back().t;
  const double span = SecondsBetween(begin, end);
  if (span < kLeastOverlap) return;
  std::vector<TimeNs> inside;
  for (const Sample& sample : samples) {
    if (sample.t >= begin && sample.t <= end) inside.push_back(sample.t);
  }
  const double covered = CoveredBy(inside);
  if (covered >= least * span) return;
  const bool attitude = std::string(name) == "attitude";
  const bool biases = attitude && covered < (1.0 - kMostly) * span;
  e->Add({&fault::kCover, name, biases ? Level::kBiases : Level::kWidens, covered / span},
         fmt::format("{}.csv ({} samples, {}) covers {:.1f} s, {:.0f} % of the {:.1f} s of imu.csv",
                     name, samples.size(), SpanOf(begin, samples.front().t, samples.back().t),
                     covered, 100.0 * covered / span, span),
         attitude ? "log the attitude for the whole flight, or cut the IMU to its time"
                  : "log it for the whole flight, or cut the log to its time");
}

// s, of the longest other stream; zero where there is none.
double LongestOther(const FlightLog& log, const std::string& stream) {
  double longest = 0.0;
  ForEachStream(log, [&](const Stream& other, const auto& samples) {
    if (samples.size() < kFewest || stream == other.name) return;
    longest = std::max(longest, SecondsBetween(samples.front().t, samples.back().t));
  });
  return longest;
}

// The unit of stamps that make a stream last `ratio` times as long as the others; null for a ratio
// that no unit explains.
const char* TimeUnitOf(double ratio) {
  constexpr std::array<const char*, 3> kNames = {"ms", "us", "ns"};
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    const double off = std::log(ratio) - 3.0 * static_cast<double>(k + 1) * std::log(10.0);
    if (std::abs(off) < 2.0 * kOtherUnit) return kNames[k];
  }
  return nullptr;
}

// The IMU is known by its rate. Any other stream is judged against it. Returns the streams whose
// stamps have another unit.
std::vector<std::string> CheckTimeUnit(const FlightLog& log, Examination* e) {
  std::vector<std::string> other_unit;
  if (log.imu.size() < kFewest) return other_unit;
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.size() < kFewest) return;
    const bool imu = std::string(stream.name) == "imu";
    const double span = SecondsBetween(samples.front().t, samples.back().t);
    const double other =
        imu ? LongestOther(log, stream.name) : SecondsBetween(log.imu.front().t, log.imu.back().t);
    const char* unit = other > 0.0 && span > 0.0 ? TimeUnitOf(span / other) : nullptr;
    const double rate = static_cast<double>(samples.size()) / std::max(1e-9, span);
    if (unit == nullptr || rate > kLeastImuRate) return;
    e->Add({&fault::kTimeUnit, stream.name, Level::kFatal, span / other, log.gravity},
           fmt::format("the stamps of {}.csv are in {}, not in s: it lasts {:.4g} s at {:.3g} Hz, "
                       "the {} {:.4g} s",
                       stream.name, unit, span, rate, imu ? "other streams" : "IMU", other),
           fmt::format("state `unit: {}` of its time", unit));
    other_unit.emplace_back(stream.name);
  });
  return other_unit;
}

}  // namespace

std::optional<Finding> MissingAttitude(const FlightLog& log) {
  if (!log.attitude.empty() || log.imu.size() < 2) return std::nullopt;
  if (SecondsBetween(log.imu.front().t, log.imu.back().t) < kLeastOverlap) return std::nullopt;
  return Finding{
      .kind = &fault::kAttitudeMissing,
      .stream = "attitude",
      .level = Level::kBiases,
      .text =
          "attitude.csv is missing: the program's own filter gives the attitude, with a heading "
          "that starts at zero and a tilt that is wrong by degrees in turns",
      .remedy = "log the autopilot's attitude"};
}

void CheckCover(const FlightLog& log, Examination* e) {
  const std::vector<std::string> other_unit = CheckTimeUnit(log, e);
  const auto has_other_unit = [&](const char* name) {
    return std::find(other_unit.begin(), other_unit.end(), name) != other_unit.end();
  };
  // `least`: share of the IMU's time that the stream must cover; fixes come in passes, and rotors
  // need not turn for the whole log.
  const auto check = [&](const auto& samples, const char* name, double least) {
    if (has_other_unit("imu") || has_other_unit(name)) return;
    if (!CheckStreamCover(log, samples, name, e)) CheckImuCover(log, samples, name, least, e);
  };
  check(log.attitude, "attitude", kMostly);
  check(log.fixes, "fixes", 0.0);
  check(log.mocap, "mocap", kMajority);
  check(log.pose, "pose", kMajority);
  check(log.rotors, "rotors", 0.0);
  check(log.motors, "motors", 0.0);
  const auto missing = log.rotors.empty() ? MissingAttitude(log) : std::nullopt;
  if (missing) e->Add(*missing);
}

}  // namespace trueline
