// Fixes whose error is correlated in time, as measurements of a chain: the changes from fix to fix.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "cost_functions/fix_residual.h"
#include "problems/vgd/passes.h"
#include "problems/vgd/segment_chain.h"
#include "problems/vgd/solver_options.h"

namespace trueline {

// Divides [from, to] at the fixes, and evenly by `interval` (s) where there is none.
inline std::vector<TimeNs> KnotsAtFixes(std::span<const Fix> fixes, TimeNs from, TimeNs to,
                                        const FixNoise& noise, double interval) {
  std::vector<TimeNs> cuts{from};
  for (const Fix& fix : fixes) {
    if (fix.t > from && fix.t < to) cuts.push_back(fix.t);
  }
  const std::size_t last_fix = cuts.size() - 1;
  cuts.push_back(to);
  std::vector<TimeNs> knots{from};
  for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
    const double seconds = SecondsBetween(cuts[i], cuts[i + 1]);
    const bool is_step = (i < last_fix || fixes.back().t >= to) && seconds <= noise.longest_step;
    const std::vector<TimeNs> even =
        EvenKnots(cuts[i], cuts[i + 1], is_step ? noise.longest_step : interval);
    knots.insert(knots.end(), even.begin() + 1, even.end());
  }
  return knots;
}

// Adds fixes to a chain whose knots are at them, and the fixes' delay to its border.
class CorrelatedFixes {
 public:
  // Adds the border unknown; `chain` must outlive this.
  CorrelatedFixes(SegmentChain* chain, const FixNoise& noise, const VgdOptions& options)
      : chain_(chain),
        noise_(noise),
        loss_(options.loss),
        loss_scale_(options.loss_scale),
        delay_{noise.latency, noise.latency_sigma},
        unit_(chain->AddBorder(0, Eigen::VectorXd::Ones(1), false)) {}

  // Adds the changes between neighbours; those after a pause count as fixes by themselves. The
  // error of fix `anchor` is zero by definition, but for its white part; it is the last but one if
  // the last is at the end of the chain. Segments from `first` to `end` hold the fixes.
  // `start_known`: another prior tells the place of the first fix.
  void Add(std::span<const Fix> fixes, std::size_t anchor, std::size_t first, std::size_t end,
           bool start_known = false) {
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      const Fix& fix = fixes[i];
      const std::size_t s = chain_->SegmentAt(fix.t, first, end);
      const double seconds =
          i > 0 ? SecondsBetween(fixes[i - 1].t, fix.t) : noise_.longest_step + 1.0;
      const double sigma = std::sqrt(noise_.StepVariance(fix.sigma, seconds));
      if (chain_->segment(s).start() < fix.t) {  // at the end of the chain
        if (i == anchor + 1) AddFix(fix, sigma, s);
      } else if (seconds <= noise_.longest_step) {
        AddStep(fix, &fixes[i - 1], seconds, sigma, s - 1);
        if (i == anchor) AddStep(fix, nullptr, seconds, noise_.white, s - 1);
      } else if (i == anchor) {
        AddFix(fix, noise_.white, s);
      } else if (i > 0 || !start_known) {
        AddFix(fix, std::sqrt(2.0) * fix.sigma, s);  // the anchor's error and its own
      }
    }
  }

  double delay() const { return delay_.At(unit_); }  // s
  const FixDelay& prior() const { return delay_; }

 private:
  void AddFix(const Fix& fix, double sigma, std::size_t s) {
    chain_->AddReading(
        s,
        new DelayedFixResidual(chain_->segment(s).StateAt(fix.t), {{fix.p_E, sigma}, delay_},
                               chain_->StateGusts(s, fix.t)),
        MakeLoss(loss_, loss_scale_), {unit_});
  }
  // The fix at the start of segment s + 1, less `first` at the start of s unless null.
  void AddStep(const Fix& fix, const Fix* first, double seconds, double sigma, std::size_t s) {
    const Eigen::Vector3d fix_E = first != nullptr ? fix.p_E - first->p_E : fix.p_E;
    auto* error = new FixStepError{fix_E, sigma, seconds, first != nullptr, delay_};
    chain_->AddStarts(s, new FixStepResidual(error), MakeLoss(loss_, loss_scale_), unit_);
  }

  SegmentChain* chain_;
  FixNoise noise_;
  FixLoss loss_;
  double loss_scale_;
  FixDelay delay_;
  double* unit_;
};

}  // namespace trueline
