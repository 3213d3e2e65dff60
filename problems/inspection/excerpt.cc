#include "problems/inspection/excerpt.h"

#include <algorithm>
#include <bit>
#include <boost/container_hash/hash.hpp>
#include <iterator>

namespace trueline {

FlightLog PartOf(const FlightLog& log, TimeNs from, TimeNs to) {
  FlightLog part;
  part.gravity = log.gravity;
  part.environment = log.environment;
  part.gates = log.gates;
  part.vehicle = log.vehicle;
  part.source = log.source;
  const auto is_inside = [&](const auto& sample) { return sample.t >= from && sample.t <= to; };
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    ForEachStream(part, [&](const Stream& of, auto& kept) {
      if constexpr (std::is_same_v<decltype(samples),
                                   const std::remove_reference_t<decltype(kept)>&>) {
        if (std::string_view(stream.name) != of.name) return;
        std::copy_if(samples.begin(), samples.end(), std::back_inserter(kept), is_inside);
      }
    });
  });
  return part;
}

std::optional<FlightLog> MiddleOfLong(const FlightLog& log) {
  constexpr double kExcerpt = 180.0;  // s
  const bool is_long =
      log.imu.size() > 1 && SecondsBetween(log.imu.front().t, log.imu.back().t) > 2.0 * kExcerpt;
  if (!is_long) return std::nullopt;
  const TimeNs from = log.imu[log.imu.size() / 2].t - FromSeconds(0.5 * kExcerpt);
  return PartOf(log, from, from + FromSeconds(kExcerpt));
}

namespace {

// Samples of a run, as of a quantised sensor single ones repeat; of so many runs one is compared,
// chosen by its content.
constexpr std::size_t kRun = 8;

std::size_t HashOf(std::size_t hash, const auto& values) {
  for (const double x : values) boost::hash_combine(hash, std::bit_cast<std::uint64_t>(x));
  return hash;
}

std::vector<std::size_t> HashesOf(const FlightLog& log) {
  std::vector<std::size_t> hashes;
  for (const ImuSample& s : log.imu) hashes.push_back(HashOf(HashOf(0, s.accel), s.gyro));
  if (!log.imu.empty()) return hashes;
  for (const ChannelsSample& s : log.motors) hashes.push_back(HashOf(0, s.values));
  return hashes;
}

}  // namespace

Fingerprint FingerprintOf(const FlightLog& log) {
  const std::vector<std::size_t> samples = HashesOf(log);
  Fingerprint runs;
  for (std::size_t i = 0; i + kRun <= samples.size(); ++i) {
    if (samples[i] % kRun != 0) continue;
    const auto run = samples.begin() + static_cast<std::ptrdiff_t>(i);
    runs.push_back(boost::hash_range(run, run + kRun));
  }
  std::ranges::sort(runs);
  runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
  return runs;
}

double SharedRecording(const Fingerprint& a, const Fingerprint& b) {
  Fingerprint shared;
  std::ranges::set_intersection(a, b, std::back_inserter(shared));
  const std::size_t shorter = std::min(a.size(), b.size());
  return shorter == 0 ? 0.0 : static_cast<double>(shared.size()) / static_cast<double>(shorter);
}

}  // namespace trueline
