#include "problems/vgd/rough_path.h"

#include <algorithm>

namespace trueline {
namespace {

// Cubic Hermite curve from a at t = 0 to b at t = h.
LineFit Hermite(const LineFit& a, const LineFit& b, double h, double t) {
  const double s = t / h;
  const double b1 = s * s * (3.0 - 2.0 * s), b2 = s * (1.0 - s) * (1.0 - s), b3 = s * s * (s - 1.0);
  const double d1 = 6.0 * s * (1.0 - s), d2 = (1.0 - s) * (1.0 - 3.0 * s), d3 = s * (3.0 * s - 2.0);
  const Eigen::Vector3d chord = b.p - a.p;
  return {a.p + b1 * chord + h * (b2 * a.v + b3 * b.v), d1 / h * chord + d2 * a.v + d3 * b.v};
}

}  // namespace

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
      return Hermite(a, b, SecondsBetween(passes_[i].end, passes_[i + 1].begin),
                     SecondsBetween(passes_[i].end, t));
    }
  }
  return NearFixes(passes_.back(), t);
}

}  // namespace trueline
