#include "problems/inspection/fix_pairs.h"

#include <algorithm>

namespace trueline {
namespace {

constexpr double kMocapGap = 0.2;  // s

std::optional<Eigen::Vector3d> MocapAt(const std::vector<PoseSample>& mocap, const LogClock& clock,
                                       double t) {
  const auto after =
      std::lower_bound(mocap.begin(), mocap.end(), t,
                       [&](const PoseSample& pose, double at) { return clock(pose.t) < at; });
  if (after == mocap.begin() || after == mocap.end()) return std::nullopt;
  const auto before = after - 1;
  const double from = clock(before->t), span = clock(after->t) - from;
  if (span > kMocapGap) return std::nullopt;
  return Eigen::Vector3d(before->p_E + (t - from) / span * (after->p_E - before->p_E));
}

}  // namespace

PairsAt FixPairs(const FlightLog& log) {
  return [&log](double lag) {
    const LogClock clock(log);
    std::vector<VectorPair> pairs;
    const std::size_t every = std::max<std::size_t>(1, log.fixes.size() / 1500);
    for (std::size_t i = 0; i < log.fixes.size(); i += every) {
      const double t = clock(log.fixes[i].t);
      if (const auto p = MocapAt(log.mocap, clock, t - lag)) {
        pairs.push_back({t, log.fixes[i].p_E, *p});
      }
    }
    return pairs;
  };
}

}  // namespace trueline
