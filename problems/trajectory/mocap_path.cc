#include "problems/trajectory/mocap_path.h"

#include <algorithm>

namespace trueline {

std::vector<Eigen::Vector3d> PathVelocity(const std::vector<PoseSample>& mocap) {
  constexpr TimeNs kHalfWindow = kNsPerSecond / 10;
  std::vector<Eigen::Vector3d> velocity(mocap.size(), Eigen::Vector3d::Zero());
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    while (mocap[i].t - mocap[first].t > kHalfWindow) ++first;
    while (last + 1 < mocap.size() && mocap[last + 1].t - mocap[i].t <= kHalfWindow) ++last;
    // At least the neighbours, if the record is slow or has a gap.
    const std::size_t from = std::min(first, i > 0 ? i - 1 : 0);
    const std::size_t to = std::min(std::max(last, i + 1), mocap.size() - 1);
    const double span = SecondsBetween(mocap[from].t, mocap[to].t);
    if (span > 0.0) velocity[i] = (mocap[to].p_E - mocap[from].p_E) / span;
  }
  return velocity;
}

std::optional<Eigen::Vector3d> PositionAt(const std::vector<PoseSample>& mocap, TimeNs t,
                                          double max_gap) {
  const auto after = std::ranges::lower_bound(mocap, t, {}, &PoseSample::t);
  if (after == mocap.end()) return std::nullopt;
  if (after->t == t) return after->p_E;
  if (after == mocap.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double span = SecondsBetween(before->t, after->t);
  if (span > max_gap) return std::nullopt;
  const double share = SecondsBetween(before->t, t) / span;
  return (1.0 - share) * before->p_E + share * after->p_E;
}

}  // namespace trueline
