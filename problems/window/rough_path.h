// A first guess of the path from the fixes alone, where a fit starts from.
#pragma once

#include <span>
#include <vector>

#include "problems/window/line_fit.h"
#include "problems/window/passes.h"

namespace trueline {

// Straight lines through nearby fixes inside of passes, cubic curves over the arcs between them.
// A fit that starts here cannot run away as an integration from poor parameters does.
class RoughPath {
 public:
  // `passes` must be in time order and not empty; their indices point into `fixes`.
  RoughPath(const std::vector<Fix>& fixes, std::span<const Pass> passes);

  // Position and velocity at t, which must not lie after the last pass.
  LineFit At(TimeNs t) const;
  TimeNs end() const { return passes_.back().end; }

 private:
  LineFit NearFixes(const Pass& pass, TimeNs t) const;

  const std::vector<Fix>& fixes_;
  std::span<const Pass> passes_;
};

}  // namespace trueline
