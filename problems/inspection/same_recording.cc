#include "problems/inspection/same_recording.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>
#include <vector>

namespace trueline {
namespace {

constexpr std::size_t kRun = 8;      // samples; of a quantised sensor single ones repeat
constexpr std::uint64_t kOneOf = 8;  // of the runs that are compared, chosen by their content
constexpr std::uint64_t kPrime = 1099511628211U;  // FNV-1a

std::uint64_t Mixed(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * kPrime;
  return hash ^ (hash >> 29);
}

constexpr std::uint64_t kBasis = 14695981039346656037U;

std::uint64_t HashOf(std::uint64_t hash, const auto& values) {
  for (const double x : values) hash = Mixed(hash, std::bit_cast<std::uint64_t>(x));
  return hash;
}

std::vector<std::uint64_t> HashesOf(const FlightLog& log) {
  std::vector<std::uint64_t> hashes;
  for (const ImuSample& s : log.imu) hashes.push_back(HashOf(HashOf(kBasis, s.accel), s.gyro));
  if (!log.imu.empty()) return hashes;
  for (const ChannelsSample& s : log.motors) hashes.push_back(HashOf(kBasis, s.values));
  return hashes;
}

}  // namespace

Fingerprint FingerprintOf(const FlightLog& log) {
  const std::vector<std::uint64_t> samples = HashesOf(log);
  Fingerprint runs;
  for (std::size_t i = 0; i + kRun <= samples.size(); ++i) {
    if (samples[i] % kOneOf != 0) continue;
    std::uint64_t run = 0;
    for (std::size_t k = 0; k < kRun; ++k) run = Mixed(run, samples[i + k]);
    runs.push_back(run);
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
