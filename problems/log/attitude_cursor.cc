#include "problems/log/attitude_cursor.h"

#include "cost_functions/models/rotation.h"

namespace trueline {

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
