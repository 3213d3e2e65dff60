#include "problems/log/first_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "problems/log/native_log.h"

namespace trueline {
namespace {

constexpr double kStep = 0.02;           // s, between samples of a turn rate
constexpr double kReach = 5.0;           // s, of the offsets that are tried
constexpr double kLeastOverlap = 8.0;    // s
constexpr double kTurns = 0.05;          // rad/s, least spread of a rate that can be compared
constexpr double kAlike = 0.6;           // correlation of a match
constexpr double kBetter = 0.08;         // correlation by which an offset must be better than none
constexpr double kOrdinaryOffset = 0.1;  // s, below which it is a latency, not a clock
constexpr double kBaseline = 0.1;        // s, over which an attitude's turn is taken
constexpr double kLongestBaseline = 0.5;
constexpr double kRepeats = 0.5;     // s, farther apart two offsets are two peaks
constexpr double kClearly = 0.02;    // correlation by which a farther peak must be better
constexpr double kLeastCover = 0.8;  // share of a stream that lies in the IMU's time

// A turn rate on a grid of kStep from `begin`; NaN where it is not known.
struct Rate {
  TimeNs begin;
  std::vector<double> values;
};

std::size_t GridSize(TimeNs begin, TimeNs end) {
  return static_cast<std::size_t>(SecondsBetween(begin, end) / kStep);
}

// Means over the grid's cells of what visit(add) adds at its times.
template <class Samples>
Rate Gridded(TimeNs begin, TimeNs end, const Samples& samples) {
  Rate rate{begin, std::vector<double>(GridSize(begin, end) + 1, 0.0)};
  std::vector<int> counts(rate.values.size(), 0);
  samples([&](TimeNs t, double value) {
    if (t < begin || t > end) return;
    const auto k = std::min(GridSize(begin, t), rate.values.size() - 1);
    rate.values[k] += value;
    ++counts[k];
  });
  double last = std::numeric_limits<double>::quiet_NaN();
  int since = 0;
  for (std::size_t k = 0; k < rate.values.size(); ++k) {
    if (counts[k] > 0) {
      last = rate.values[k] / counts[k];
      since = 0;
    }
    constexpr int kHeld = 10;  // cells over which a slow stream's value is held
    rate.values[k] = since++ <= kHeld ? last : std::numeric_limits<double>::quiet_NaN();
  }
  return rate;
}

// Pearson's correlation of a(k) with b(k + lag), NaN if too little is known of both.
double Correlation(const std::vector<double>& a, const std::vector<double>& b, int lag) {
  double n = 0, sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
  const int size = static_cast<int>(a.size());
  for (int k = std::max(0, -lag); k < std::min(size, size - lag); ++k) {
    const double x = a[k], y = b[k + lag];
    if (std::isnan(x) || std::isnan(y)) continue;
    n += 1;
    sa += x;
    sb += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  const double va = aa / n - std::pow(sa / n, 2), vb = bb / n - std::pow(sb / n, 2);
  if (n * kStep < kLeastOverlap || !(va > kTurns * kTurns) || !(vb > kTurns * kTurns)) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return (ab / n - sa / n * sb / n) / std::sqrt(va * vb);
}

std::string SpanOf(TimeNs origin, TimeNs from, TimeNs to) {
  return fmt::format("{:.1f} to {:.1f} s", SecondsBetween(origin, from),
                     SecondsBetween(origin, to));
}

template <class Sample>
void LookAtCover(const std::vector<Sample>& samples, const FlightLog& log, const char* name,
                 std::vector<std::string>* findings) {
  if (samples.empty() || log.imu.empty()) return;
  const TimeNs begin = log.imu.front().t, end = log.imu.back().t;
  const double longest =
      std::max(SecondsBetween(begin, end), SecondsBetween(samples.front().t, samples.back().t));
  if (longest < kLeastOverlap) return;
  const auto inside = std::count_if(samples.begin(), samples.end(),
                                    [&](const Sample& s) { return s.t >= begin && s.t <= end; });
  const double share = static_cast<double>(inside) / static_cast<double>(samples.size());
  if (share >= kLeastCover) return;
  findings->push_back(fmt::format(
      "only {:.0f} % of {} lies within the time of imu.csv ({}): {} spans {}. Export the whole "
      "flight, or bring the clocks together (time: offset in the map of trueline-convert)",
      100.0 * share, name, SpanOf(begin, begin, end), name,
      SpanOf(begin, samples.front().t, samples.back().t)));
}

std::string Late(double seconds) {
  return fmt::format("{:.2f} s {}", std::abs(seconds), seconds > 0.0 ? "later" : "earlier");
}

void LookAtClock(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                 const char* name, std::vector<std::string>* findings) {
  const ClockOffset offset = OffsetAgainstGyro(log.imu, attitude);
  if (!(offset.correlation > kAlike) || std::abs(offset.seconds) < kOrdinaryOffset) return;
  if (offset.correlation < offset.as_stamped + kBetter) return;
  findings->push_back(fmt::format(
      "the turns of {} come {} than those of the gyroscope{} (correlation {:.2f}, as stamped "
      "{:.2f}): the clocks disagree. Nothing is corrected; give {:+.2f} s as its time: offset in "
      "the map of trueline-convert",
      name, Late(offset.seconds),
      offset.or_else ? fmt::format(", or {}, as laps repeat", Late(*offset.or_else)) : "",
      offset.correlation, offset.as_stamped, -offset.seconds));
}

std::vector<AttitudeSample> AttitudesOf(const std::vector<PoseSample>& poses) {
  std::vector<AttitudeSample> attitudes;
  attitudes.reserve(poses.size());
  for (const PoseSample& pose : poses) attitudes.push_back({pose.t, pose.q_E});
  return attitudes;
}

}  // namespace

ClockOffset OffsetAgainstGyro(const std::vector<ImuSample>& imu,
                              const std::vector<AttitudeSample>& attitude) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  ClockOffset best{0.0, kNone, kNone, {}};
  if (imu.size() < 2 || attitude.size() < 2) return best;
  const TimeNs begin = imu.front().t, end = imu.back().t;
  if (SecondsBetween(begin, end) < kLeastOverlap) return best;
  const Rate gyro = Gridded(begin, end, [&](const auto& add) {
    // The mean rate over the attitude's baseline.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0, k = 0; i < imu.size(); ++i) {
      sum += imu[i].gyro;
      while (SecondsBetween(imu[k].t, imu[i].t) > kBaseline) sum -= imu[k++].gyro;
      add((imu[k].t + imu[i].t) / 2, sum.norm() / static_cast<double>(i - k + 1));
    }
  });
  const Rate turn = Gridded(begin, end, [&](const auto& add) {
    for (std::size_t i = 0, k = 0; i < attitude.size(); ++i) {
      while (k < i && SecondsBetween(attitude[k + 1].t, attitude[i].t) >= kBaseline) ++k;
      const double dt = SecondsBetween(attitude[k].t, attitude[i].t);
      if (dt < kBaseline || dt > kLongestBaseline) continue;
      add((attitude[k].t + attitude[i].t) / 2,
          attitude[k].q_Ep_I.angularDistance(attitude[i].q_Ep_I) / dt);
    }
  });
  const int reach = static_cast<int>(kReach / kStep);
  std::vector<std::pair<double, double>> tried;  // seconds, correlation
  for (int lag = -reach; lag <= reach; ++lag) {
    tried.emplace_back(lag * kStep, Correlation(gyro.values, turn.values, lag));
  }
  best.as_stamped = tried[reach].second;
  const auto better = [](const auto& a, const auto& b) { return a.second < b.second; };
  std::erase_if(tried, [](const auto& at) { return std::isnan(at.second); });
  if (tried.empty()) return best;
  // Of offsets that are as good the nearest one is the likeliest.
  const double top = std::max_element(tried.begin(), tried.end(), better)->second;
  std::erase_if(tried, [&](const auto& at) { return at.second < top - kClearly; });
  const auto nearest = *std::min_element(
      tried.begin(), tried.end(),
      [](const auto& a, const auto& b) { return std::abs(a.first) < std::abs(b.first); });
  std::vector<std::pair<double, double>> others;
  best.correlation = -1.0;
  for (const auto& at : tried) {
    if (std::abs(at.first - nearest.first) > kRepeats) {
      others.push_back(at);
    } else if (at.second > best.correlation) {
      std::tie(best.seconds, best.correlation) = at;
    }
  }
  if (!others.empty()) best.or_else = std::max_element(others.begin(), others.end(), better)->first;
  return best;
}

FlightLog ReadAndLook(const std::filesystem::path& directory) {
  FlightLog log = ReadNativeLog(directory);
  for (const std::string& finding : FirstLook(log)) log.warnings.push_back(finding);
  return log;
}

std::vector<std::string> FirstLook(const FlightLog& log) {
  std::vector<std::string> findings;
  LookAtCover(log.attitude, log, "attitude.csv", &findings);
  LookAtCover(log.fixes, log, "fixes.csv", &findings);
  LookAtCover(log.mocap, log, "mocap.csv", &findings);
  LookAtCover(log.rotors, log, "rotors.csv", &findings);
  if (log.attitude.empty() && log.rotors.empty() && log.imu.size() > 1 &&
      SecondsBetween(log.imu.front().t, log.imu.back().t) > kLeastOverlap) {
    findings.emplace_back(
        "attitude.csv is missing: the program's own filter gives the attitude, with a heading that "
        "starts at zero and a tilt that is wrong by degrees in turns. Log the autopilot's "
        "attitude");
  }
  LookAtClock(log, log.attitude, "attitude.csv", &findings);
  LookAtClock(log, AttitudesOf(log.mocap), "mocap.csv", &findings);
  return findings;
}

}  // namespace trueline
