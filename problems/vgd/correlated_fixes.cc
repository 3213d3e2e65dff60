#include "problems/vgd/correlated_fixes.h"

#include <cmath>

#include "problems/vgd/segment.h"
#include "problems/vgd/solver_options.h"

namespace trueline {

std::vector<TimeNs> KnotsAtFixes(std::span<const Fix> fixes, TimeNs from, TimeNs to,
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

CorrelatedFixes::CorrelatedFixes(SegmentChain* chain, const FixNoise& noise,
                                 const VgdOptions& options)
    : chain_(chain),
      noise_(noise),
      loss_(options.loss),
      loss_scale_(options.loss_scale),
      delay_{noise.latency, noise.latency_sigma},
      unit_(chain->AddBorder(0, Eigen::VectorXd::Ones(1), false)) {}

void CorrelatedFixes::AddFix(const Fix& fix, double sigma, std::size_t s) {
  chain_->AddReading(
      s,
      new DelayedFixResidual(chain_->segment(s).StateAt(fix.t), {{fix.p_E, sigma}, delay_},
                             chain_->StateGusts(s, fix.t)),
      MakeLoss(loss_, loss_scale_), {unit_});
}

void CorrelatedFixes::AddStep(const Fix& fix, const Fix* first, double seconds, double sigma,
                              std::size_t s) {
  const Eigen::Vector3d fix_E = first != nullptr ? fix.p_E - first->p_E : fix.p_E;
  auto* error = new FixStepError{fix_E, sigma, seconds, first != nullptr, delay_};
  chain_->AddStarts(s, new FixStepResidual(error), MakeLoss(loss_, loss_scale_), unit_);
}

void CorrelatedFixes::Add(std::span<const Fix> fixes, std::size_t anchor, std::size_t first,
                          std::size_t end, bool start_known) {
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

}  // namespace trueline
