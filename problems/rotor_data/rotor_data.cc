#include "problems/rotor_data/rotor_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

constexpr double kShortest = 1.0;  // s

// Commands, held from one to the next, into the speeds of rotors that follow them.
void Follow(double lag, RotorData* data) {
  std::vector<double> command = data->speeds.front();
  for (std::size_t i = 1; i < data->speeds.size(); ++i) {
    const double left = std::exp(-(data->speed_times[i] - data->speed_times[i - 1]) / lag);
    const std::vector<double>& before = data->speeds[i - 1];
    std::vector<double>& speeds = data->speeds[i];
    for (std::size_t r = 0; r < speeds.size(); ++r) {
      const double next = speeds[r];
      speeds[r] = command[r] + left * (before[r] - command[r]);
      command[r] = next;
    }
  }
}

void CheckStreams(const FlightLog& log, int rotors, const std::vector<PoseSample>& poses,
                  const char* pose_file) {
  if (log.rotors.empty()) {
    throw ErrorAt(log.directory, 0,
                  "has no rotors.csv; --drive=rotors needs rotor speeds beside imu.csv");
  }
  if (static_cast<int>(log.rotors.front().values.size()) != rotors) {
    throw ErrorAt(log.directory + "/rotors.csv", 0,
                  fmt::format("has {} speeds, the vehicle {} rotors; list each rotor in vehicle",
                              log.rotors.front().values.size(), rotors));
  }
  if (poses.size() < 2) {
    throw ErrorAt(
        log.directory, 0,
        fmt::format("has no {}; choose the other of pose and mocap by fit_to", pose_file));
  }
}

}  // namespace

RotorInput RotorData::InputAt(double t) const {
  const auto after = std::upper_bound(speed_times.begin(), speed_times.end(), t);
  if (after == speed_times.begin()) return {t + since_start, speeds.front()};
  if (after == speed_times.end()) return {t + since_start, speeds.back()};
  const std::size_t i = after - speed_times.begin();
  const double share = (t - speed_times[i - 1]) / (speed_times[i] - speed_times[i - 1]);
  std::vector<double> result(speeds[i].size());
  for (std::size_t r = 0; r < result.size(); ++r) {
    result[r] = (1.0 - share) * speeds[i - 1][r] + share * speeds[i][r];
  }
  return {t + since_start, std::move(result)};
}

RotorData MakeRotorData(const FlightLog& log, int rotors, const RotorDataOptions& options) {
  const bool mocap = options.source == PoseSource::kMocap;
  const std::vector<PoseSample>& poses = mocap ? log.mocap : log.pose;
  CheckStreams(log, rotors, poses, mocap ? "mocap.csv" : "pose.csv");
  TimeNs begin = std::max({log.imu.front().t, poses.front().t, log.rotors.front().t});
  TimeNs end = std::min({log.imu.back().t, poses.back().t, log.rotors.back().t});
  begin += FromSeconds(options.start);
  end -= FromSeconds(options.end);
  if (options.duration > 0.0) end = std::min(end, begin + FromSeconds(options.duration));
  if (SecondsBetween(begin, end) < kShortest) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("imu, rotors and poses overlap by {:.2f} s; {} s are needed",
                              SecondsBetween(begin, end), kShortest));
  }
  RotorData data;
  data.origin = begin;
  data.since_start = SecondsBetween(log.imu.front().t, begin);
  data.attitude = options.attitude;
  const auto within = [&](TimeNs t) { return t >= begin && t <= end; };
  for (const ImuSample& s : log.imu) {
    if (within(s.t)) data.imu.push_back({SecondsBetween(begin, s.t), s.accel, s.gyro});
  }
  double next = 0.0;
  for (const PoseSample& s : poses) {
    const double t = SecondsBetween(begin, s.t);
    if (!within(s.t) || t < next) continue;
    data.poses.push_back({t, s.p_E, s.q_E.normalized()});
    next = t + 0.8 / options.pose_rate;
  }
  for (const ChannelsSample& s : log.rotors) {
    data.speed_times.push_back(SecondsBetween(begin, s.t) + options.rotor_delay);
    data.speeds.push_back(s.values);
  }
  if (options.motor_lag > 0.0) Follow(options.motor_lag, &data);
  return data;
}

}  // namespace trueline
