#include "problems/vgd/rough_path.h"

#include <algorithm>

#include "cost_functions/models/cubic_path.h"

namespace trueline {

RoughPath::RoughPath(const std::vector<Fix>& fixes, std::span<const Pass> passes)
    : fixes_(fixes), passes_(passes) {}

// A line through the fixes within half a second, at least through a third of the pass: a sparse
// pass must still give a direction.
LineFit RoughPath::NearFixes(const Pass& pass, TimeNs t) const {
  const TimeNs reach = std::max(FromSeconds(0.5), (pass.end - pass.begin) / 3);
  std::size_t first = pass.first, last = pass.last;
  while (first + 2 < last && fixes_[first].t < t - reach) ++first;
  while (last > first + 2 && fixes_[last].t > t + reach) --last;
  return FitLine(fixes_, first, last, t);
}

LineFit RoughPath::At(TimeNs t) const {
  for (std::size_t i = 0; i < passes_.size(); ++i) {
    if (t <= passes_[i].end && (t >= passes_[i].begin || i == 0)) return NearFixes(passes_[i], t);
    if (t > passes_[i].end && i + 1 < passes_.size() && t < passes_[i + 1].begin) {
      const LineFit a = NearFixes(passes_[i], passes_[i].end);
      const LineFit b = NearFixes(passes_[i + 1], passes_[i + 1].begin);
      const double h = SecondsBetween(passes_[i].end, passes_[i + 1].begin);
      const double u = SecondsBetween(passes_[i].end, t) / h;
      return {CubicPath(a.p, a.v, b.p, b.v, h, u), CubicPathVelocity(a.p, a.v, b.p, b.v, h, u)};
    }
  }
  return NearFixes(passes_.back(), t);
}

}  // namespace trueline
