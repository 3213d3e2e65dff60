#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "problems/against/references.h"
#include "problems/common/error.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kHigh = 0.8;          // of the flight's usual greatest height above the floor
constexpr double kLeastHeight = 0.15;  // m
constexpr double kSlow = 0.15;         // m/s, of climb or descent
constexpr double kClimbStep = 0.1;     // s, before and after, over which the climb is measured
constexpr double kMaxGap = 0.3;        // s, between positions or attitudes
constexpr double kLeastSeconds = 3.0;  // of steady flight
constexpr double kBlock = 1.0;         // s
constexpr double kFrozen = 0.2;        // s, of one command: the controller has stopped
constexpr double kCrash = 1.0;         // s, frozen
constexpr double kFull = 65534.5 / 65535.0;  // the last step of a command of 16 bits
constexpr double kOff = 0.02;                // of the median total: the motors stand still
constexpr double kAirborne = 0.5;            // of the median total, below which nothing flies

struct Height {
  TimeNs t;
  double value;  // m, positive up
};

template <class Sample>
std::vector<Height> HeightsOf(const std::vector<Sample>& samples) {
  std::vector<Height> heights;
  heights.reserve(samples.size());
  for (const Sample& sample : samples) heights.push_back({sample.t, -sample.p_E.z()});
  return heights;
}

std::vector<Height> HeightsOf(const FlightLog& log) {
  if (!log.mocap.empty()) return HeightsOf(log.mocap);
  return !log.pose.empty() ? HeightsOf(log.pose) : HeightsOf(log.fixes);
}

// Between two samples; no value outside of the stream or in a gap.
std::optional<double> HeightAt(const std::vector<Height>& heights, TimeNs t) {
  const auto after = std::ranges::upper_bound(heights, t, {}, &Height::t);
  if (after == heights.begin() || after == heights.end()) return std::nullopt;
  const auto before = after - 1;
  const double span = SecondsBetween(before->t, after->t);
  if (span > kMaxGap) return std::nullopt;
  return std::lerp(before->value, after->value, SecondsBetween(before->t, t) / span);
}

// Cosine of the tilt against the vertical; 1 where no attitude is logged.
class TiltCursor {
 public:
  explicit TiltCursor(const FlightLog& log) : attitude_(log.attitude) {
    if (!attitude_.empty()) return;
    for (const auto* poses : {&log.mocap, &log.pose}) {
      if (!attitude_.empty()) break;
      for (const PoseSample& pose : *poses) attitude_.push_back({pose.t, pose.q_E});
    }
  }

  double Cosine(TimeNs t) {
    Eigen::Quaterniond q;
    if (attitude_.empty() || !cursor_.At(t, kMaxGap, &q)) return 1.0;
    return (q * Eigen::Vector3d::UnitZ()).z();
  }

 private:
  std::vector<AttitudeSample> attitude_;
  AttitudeCursor cursor_{attitude_};
};

// Commands as thrust: by sample, by channel.
std::vector<ChannelsSample> CommandsOf(const FlightLog& log) {
  if (!log.motors.empty()) return log.motors;
  std::vector<ChannelsSample> squares = log.rotors;
  for (ChannelsSample& sample : squares) {
    for (double& value : sample.values) value *= value;
  }
  return squares;
}

bool IsOff(const ChannelsSample& sample) {
  return std::ranges::all_of(sample.values, [](double value) { return value == 0.0; });
}

// Removes commands that have stood still for a while, as after a crash that ends the controller.
// Returns how long they did, in s.
double RemoveFrozen(double step, std::vector<ChannelsSample>* commands) {
  std::vector<ChannelsSample> moving;
  std::size_t same = 0;  // samples before this one that it repeats
  for (std::size_t i = 0; i < commands->size(); ++i) {
    const ChannelsSample& sample = (*commands)[i];
    same = i > 0 && sample.values == (*commands)[i - 1].values ? same + 1 : 0;
    if (step * static_cast<double>(same) < kFrozen || IsOff(sample)) moving.push_back(sample);
  }
  const std::size_t removed = commands->size() - moving.size();
  *commands = std::move(moving);
  return step * static_cast<double>(removed);
}

double MedianTotal(const std::vector<ChannelsSample>& commands) {
  std::vector<double> totals;
  for (const ChannelsSample& sample : commands) {
    if (TotalOf(sample) > 0.0) totals.push_back(TotalOf(sample));
  }
  return totals.empty() ? 0.0 : LowerMedian(std::move(totals));
}

// Height from which on the vehicle is clear of the floor: -infinity where the log is all flight.
double LeastHeight(const std::vector<ChannelsSample>& commands, double median,
                   const std::vector<Height>& heights) {
  std::vector<double> floor, flown;
  for (const ChannelsSample& sample : commands) {
    const auto height = HeightAt(heights, sample.t);
    if (!height) continue;
    if (TotalOf(sample) < kOff * median) floor.push_back(*height);
    if (TotalOf(sample) > kAirborne * median) flown.push_back(*height);
  }
  if (floor.empty() || flown.empty()) return -std::numeric_limits<double>::infinity();
  const double ground = LowerMedian(std::move(floor));
  return ground + std::max(kLeastHeight, kHigh * (Quantile(std::move(flown), 0.95) - ground));
}

struct SteadyFlight {
  std::vector<ChannelsSample> commands;
  double cosine = 0.0;  // of the tilt, mean
};

SteadyFlight SteadyPartOf(const FlightLog& log, const std::vector<ChannelsSample>& commands) {
  const std::vector<Height> heights = HeightsOf(log);
  const double median = MedianTotal(commands);
  const double least = LeastHeight(commands, median, heights);
  TiltCursor tilt(log);
  SteadyFlight steady;
  std::vector<double> cosines;
  for (const ChannelsSample& sample : commands) {
    const auto now = HeightAt(heights, sample.t);
    const auto before = HeightAt(heights, sample.t - FromSeconds(kClimbStep));
    const auto after = HeightAt(heights, sample.t + FromSeconds(kClimbStep));
    if (!now || !before || !after || *now < least) continue;
    if (std::abs(*after - *before) > kSlow * 2.0 * kClimbStep) continue;
    if (TotalOf(sample) < kAirborne * median) continue;
    steady.commands.push_back(sample);
    cosines.push_back(tilt.Cosine(sample.t));
  }
  if (!cosines.empty()) steady.cosine = Mean(cosines);
  return steady;
}

// Relative standard error of the mean of a channel, by blocks of a second.
double StandardError(const std::vector<double>& values, std::size_t block) {
  std::vector<double> means;
  for (std::size_t i = 0; i + block <= values.size(); i += block) {
    means.push_back(Mean({values.begin() + static_cast<std::ptrdiff_t>(i),
                          values.begin() + static_cast<std::ptrdiff_t>(i + block)}));
  }
  const double mean = Mean(means);
  double squares = 0.0;
  for (const double m : means) squares += (m - mean) * (m - mean);
  const auto n = static_cast<double>(means.size());
  return n < 2.0 ? 1.0 : std::sqrt(squares / (n - 1.0) / n) / mean;
}

std::optional<double> VoltageOf(const FlightLog& log, const std::vector<ChannelsSample>& steady) {
  std::vector<double> volts;
  for (const ChannelsSample& sample : steady) {
    const auto at = std::ranges::lower_bound(log.battery, sample.t, {}, &ScalarSample::t);
    if (at != log.battery.end()) volts.push_back(at->value);
  }
  return volts.empty() ? std::nullopt : std::optional<double>(Mean(volts));
}

double MeanStep(const std::vector<ChannelsSample>& samples) {
  if (samples.size() < 2) return 0.0;
  return SecondsBetween(samples.front().t, samples.back().t) /
         static_cast<double>(samples.size() - 1);
}

void Require(const FlightLog& log, bool there, const char* what) {
  if (!there) throw ErrorAt(log.directory, 0, what);
}

}  // namespace

double TotalOf(const ChannelsSample& sample) {
  return std::accumulate(sample.values.begin(), sample.values.end(), 0.0);
}

double AirborneTotal(const std::vector<ChannelsSample>& commands) {
  return kAirborne * MedianTotal(commands);
}

double LeastHeight(const FlightLog& log) {
  const std::vector<ChannelsSample> commands = CommandsOf(log);
  return LeastHeight(commands, MedianTotal(commands), HeightsOf(log));
}

double CensoredMean(const std::vector<double>& values, double full) {
  double mean = Mean(values);
  const auto n = static_cast<double>(values.size());
  const auto bounds =
      static_cast<double>(std::ranges::count_if(values, [&](double v) { return v >= full; }));
  if (bounds == 0.0 || bounds == n) return mean;
  double variance = 0.0;
  for (const double v : values) variance += (v - mean) * (v - mean) / n;
  constexpr int kRounds = 50;  // of expectation and maximisation
  for (int i = 0; i < kRounds && variance > 0.0; ++i) {
    const double sigma = std::sqrt(variance);
    const double a = (full - mean) / sigma;
    const double density = std::exp(-0.5 * a * a) / std::sqrt(2.0 * std::numbers::pi);
    const double hazard = density / std::max(0.5 * std::erfc(a / std::numbers::sqrt2), 1e-12);
    const double expected = mean + sigma * hazard;
    const double spread = variance * std::max(0.0, 1.0 + a * hazard - hazard * hazard);
    double sum = bounds * expected, squares = 0.0;
    for (const double v : values) sum += v < full ? v : 0.0;
    mean = sum / n;
    for (const double v : values) squares += v < full ? (v - mean) * (v - mean) : 0.0;
    variance = (squares + bounds * (spread + (expected - mean) * (expected - mean))) / n;
  }
  return mean;
}

CommandTrim TrimOf(const FlightLog& log) {
  Require(log, !log.motors.empty() || !log.rotors.empty(),
          "has neither motors.csv nor rotors.csv; --against compares what motors are commanded");
  Require(log, !log.mocap.empty() || !log.pose.empty() || !log.fixes.empty(),
          "has no positions, which show when the vehicle flies; log them");
  std::vector<ChannelsSample> commands = CommandsOf(log);
  const double step = MeanStep(commands);
  const double frozen = RemoveFrozen(step, &commands);
  const SteadyFlight flight = SteadyPartOf(log, commands);
  const std::vector<ChannelsSample>& steady = flight.commands;
  CommandTrim trim;
  trim.log = log.directory;
  const std::string crash =
      frozen < kCrash ? ""
                      : fmt::format(
                            "{}: the commands stand still for {:.1f} s, as after a crash; "
                            "that part is left out",
                            log.directory, frozen);
  if (!crash.empty()) trim.warnings.push_back(crash);
  trim.seconds = step * static_cast<double>(steady.size());
  if (!(trim.seconds >= kLeastSeconds)) {
    throw NoUsableResult(
        fmt::format("{}: only {:.1f} s of steady flight above the floor, {:g} s are needed: hover, "
                    "or fly level{}",
                    log.directory, trim.seconds, kLeastSeconds,
                    crash.empty() ? "" : ". The commands stand still later, as after a crash"));
  }
  trim.tilt = 1.0 / flight.cosine - 1.0;
  trim.is_speed = log.motors.empty();
  trim.voltage = VoltageOf(log, steady);
  if (log.vehicle) trim.mass = log.vehicle->mass;
  const auto channels = static_cast<Eigen::Index>(steady.front().values.size());
  const auto block = static_cast<std::size_t>(std::max(1.0, kBlock / step));
  trim.command.resize(channels);
  trim.sigma.resize(channels);
  trim.saturated.resize(channels);
  // Forces in newton, and squares of speeds, have no known end.
  const bool has_end = !trim.is_speed && channels > 1;
  for (Eigen::Index k = 0; k < channels; ++k) {
    std::vector<double> values;
    for (const ChannelsSample& sample : steady) {
      values.push_back(sample.values[static_cast<std::size_t>(k)]);
    }
    const auto full = std::ranges::count_if(values, [](double v) { return v >= kFull; });
    trim.saturated[k] =
        has_end ? static_cast<double>(full) / static_cast<double>(values.size()) : 0;
    trim.command[k] = flight.cosine * (has_end ? CensoredMean(values, kFull) : Mean(values));
    trim.sigma[k] = StandardError(values, block);
    if (trim.command[k] > 0.0) continue;
    throw NoUsableResult(fmt::format("{}: command {} is zero or negative in flight; check the map",
                                     log.directory, k + 1));
  }
  return trim;
}

}  // namespace trueline
