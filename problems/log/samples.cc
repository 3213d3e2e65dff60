#include "problems/log/samples.h"

#include <algorithm>
#include <utility>

#include "cost_functions/models/rotation.h"
#include "problems/result/statistics.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes) {
  std::vector<double> sigmas;
  for (const Fix& fix : fixes) sigmas.push_back(fix.sigma);
  return Quantile(std::move(sigmas), 0.5);
}

const Gate* GateOf(const FlightLog& log, int id) {
  const auto gate = std::ranges::find(log.gates, id, &Gate::id);
  return gate == log.gates.end() ? nullptr : &*gate;
}

bool AttitudeCursor::At(TimeNs t, double max_gap, Eigen::Quaterniond* q) {
  while (i_ + 1 < samples_.size() && samples_[i_ + 1].t <= t) ++i_;
  if (t < samples_[i_].t || i_ + 1 >= samples_.size()) return false;
  const AttitudeSample &before = samples_[i_], &after = samples_[i_ + 1];
  const double span = SecondsBetween(before.t, after.t);
  if (span > max_gap) return false;
  if (turn_of_ != i_ + 1) {
    turn_of_ = i_ + 1;
    turn_ = RotationVector(before.q_Ep_I.conjugate() * after.q_Ep_I);
  }
  *q = before.q_Ep_I * RotationByVector(SecondsBetween(before.t, t) / span * turn_);
  return true;
}

}  // namespace trueline
