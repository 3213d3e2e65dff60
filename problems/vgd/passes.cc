#include "problems/vgd/passes.h"

#include <algorithm>

#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/rough_path.h"

namespace trueline {

std::vector<Pass> FindPasses(const std::vector<Fix>& fixes, const PassOptions& options) {
  std::vector<Pass> passes;
  std::size_t first = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const bool last_of_run =
        i + 1 == fixes.size() || SecondsBetween(fixes[i].t, fixes[i + 1].t) > options.pass_gap;
    if (!last_of_run) continue;
    if (static_cast<int>(i - first + 1) >= options.min_fixes) {
      passes.push_back({first, i, fixes[first].t, fixes[i].t});
    }
    first = i + 1;
  }
  return passes;
}

namespace {

// Index of the last fix of the pass that begins with fixes[first], and is to last until `end`.
std::size_t LastOfPass(const std::vector<Fix>& fixes, std::size_t first, std::size_t run_end,
                       TimeNs end) {
  std::size_t last = first;
  while (last + 1 < run_end && fixes[last + 1].t <= end) ++last;
  return last;
}

// False for mocap that is too slow throughout.
bool CanInterpolate(const std::vector<PoseSample>& mocap) {
  const auto close = [](const PoseSample& a, const PoseSample& b) {
    return SecondsBetween(a.t, b.t) <= kLongestMocapGap;
  };
  return std::ranges::adjacent_find(mocap, close) != mocap.end();
}

}  // namespace

std::vector<Pass> DividePasses(const std::vector<Fix>& fixes, const PassOptions& options,
                               const ContinuousFixes& found) {
  PassOptions whole = options;
  whole.pass_gap = found.noise.longest_step;
  std::vector<Pass> passes;
  for (const Pass& run : FindPasses(fixes, whole)) {
    for (std::size_t first = run.first; first <= run.last;) {
      const std::size_t last =
          LastOfPass(fixes, first, run.last + 1, fixes[first].t + FromSeconds(found.pass));
      if (static_cast<int>(last - first + 1) >= options.min_fixes) {
        passes.push_back({first, last, fixes[first].t, fixes[last].t});
      }
      const TimeNs next = fixes[last].t + FromSeconds(found.arc);
      first = last + 1;
      while (first <= run.last && fixes[first].t < next) ++first;
    }
  }
  return passes;
}

std::optional<ArcTruth> TruthAtPass(const FlightLog& log, const Pass& next) {
  constexpr int kFixes = 5;  // of the next pass
  if (CanInterpolate(log.mocap)) {
    const auto p_E = PositionAt(log.mocap, next.begin, kLongestMocapGap);
    return p_E ? std::optional<ArcTruth>({*p_E, true, 0.0}) : std::nullopt;
  }
  const std::size_t last = std::min(next.last, next.first + kFixes - 1);
  const LineFit line = FitLine(log.fixes, next.first, last, next.begin);
  return ArcTruth{line.p, false, line.sigma};
}

}  // namespace trueline
