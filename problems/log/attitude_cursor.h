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
  bool At(TimeNs t, double max_gap, Eigen::Quaterniond* q);

 private:
  const std::vector<AttitudeSample>& samples_;
  std::size_t i_ = 0;
  std::size_t turn_of_ = 0;  // to this sample
  Eigen::Vector3d turn_;     // rad, from the one before
};

}  // namespace trueline
