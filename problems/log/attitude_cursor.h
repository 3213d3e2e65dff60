// The attitude between the samples of its stream, for times that ascend.
#pragma once

#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

class AttitudeCursor {
 public:
  // `samples` must outlive this object.
  explicit AttitudeCursor(const std::vector<AttitudeSample>& samples) : samples_(samples) {}

  // False if t is outside of the stream or in a gap longer than max_gap (s).
  bool At(TimeNs t, double max_gap, Eigen::Quaterniond* q) {
    while (i_ + 1 < samples_.size() && samples_[i_ + 1].t <= t) ++i_;
    if (t < samples_[i_].t || i_ + 1 >= samples_.size()) return false;
    const double span = SecondsBetween(samples_[i_].t, samples_[i_ + 1].t);
    if (span > max_gap) return false;
    const double s = SecondsBetween(samples_[i_].t, t) / span;
    *q = samples_[i_].q_Ep_I.slerp(s, samples_[i_ + 1].q_Ep_I);
    return true;
  }

 private:
  const std::vector<AttitudeSample>& samples_;
  std::size_t i_ = 0;
};

}  // namespace trueline
