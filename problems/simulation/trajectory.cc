#include "problems/simulation/trajectory.h"

#include <algorithm>
#include <cmath>

namespace trueline::simulation {

TruePose Trajectory::At(double t) const {
  const double place = std::clamp((t - start()) * rate_, 0.0, samples_.size() - 1.0);
  const std::size_t i = std::min(static_cast<std::size_t>(place), samples_.size() - 2);
  const TruthSample& a = samples_[i];
  const TruthSample& b = samples_[i + 1];
  const double f = place - static_cast<double>(i);
  const double dt = 1.0 / rate_;
  const Vector3d slip_a = dt * a.v_E - (b.p_E - a.p_E);
  const Vector3d slip_b = (b.p_E - a.p_E) - dt * b.v_E;
  TruePose pose;
  pose.p_E = a.p_E + f * (b.p_E - a.p_E) + f * (1.0 - f) * ((1.0 - f) * slip_a + f * slip_b);
  pose.q_E_B = a.q_E_B.slerp(f, b.q_E_B);
  pose.q_Ep_I = a.q_Ep_I.slerp(f, b.q_Ep_I);
  return pose;
}

const TruthSample& Trajectory::Nearest(double t) const {
  const double place = std::clamp((t - start()) * rate_, 0.0, samples_.size() - 1.0);
  return samples_[static_cast<std::size_t>(std::lround(place))];
}

std::vector<double> StreamTimes(double rate, double duration) {
  std::vector<double> times;
  const auto count = static_cast<std::size_t>(std::floor(duration * rate + 1e-6)) + 1;
  times.reserve(count);
  for (std::size_t i = 0; i < count; ++i) times.push_back(static_cast<double>(i) / rate);
  return times;
}

}  // namespace trueline::simulation
