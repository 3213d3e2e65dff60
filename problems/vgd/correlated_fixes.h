// Fixes whose error is correlated in time, as measurements of a chain: the changes from fix to fix.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "cost_functions/fix_residual.h"
#include "problems/vgd/passes.h"
#include "problems/vgd/segment_chain.h"

namespace trueline {

// Divides [from, to] at the fixes, and evenly by `interval` (s) where there is none.
std::vector<TimeNs> KnotsAtFixes(std::span<const Fix> fixes, TimeNs from, TimeNs to,
                                 const FixNoise& noise, double interval);

// Adds fixes to a chain whose knots are at them, and the fixes' delay to its border.
class CorrelatedFixes {
 public:
  // Adds the border unknown; `chain` must outlive this.
  CorrelatedFixes(SegmentChain* chain, const FixNoise& noise, const VgdOptions& options);

  // Adds the changes between neighbours; those after a pause count as fixes by themselves. The
  // error of fix `anchor` is zero by definition, but for its white part; it is the last but one if
  // the last is at the end of the chain. Segments from `first` to `end` hold the fixes.
  // `start_known`: another prior tells the place of the first fix.
  void Add(std::span<const Fix> fixes, std::size_t anchor, std::size_t first, std::size_t end,
           bool start_known = false);

  double delay() const { return delay_.At(unit_); }  // s
  const FixDelay& prior() const { return delay_; }

 private:
  void AddFix(const Fix& fix, double sigma, std::size_t s);
  // The fix at the start of segment s + 1, less `first` at the start of s unless null.
  void AddStep(const Fix& fix, const Fix* first, double seconds, double sigma, std::size_t s);

  SegmentChain* chain_;
  FixNoise noise_;
  FixLoss loss_;
  double loss_scale_;
  FixDelay delay_;
  double* unit_;
};

}  // namespace trueline
