// Moments that a log does not show and an autopilot has to hold against: eddies that meet the
// vehicle at random times, each with a random turn about a random axis that rises and falls as a
// raised cosine. Not a Gauss-Markov process, which the estimators assume (RotorNoise): few eddies
// act at a time, so sizes have heavy tails, and the spectrum falls faster.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "problems/common/random.h"

namespace trueline::simulation {

class SlowMoments {
 public:
  // `rms` of each axis, rad/s^2.
  SlowMoments(double rms, std::uint64_t seed) : rms_(rms), random_(seed, "slow moments") {}

  // rad/s^2, body axes. Call with times [s] that do not fall.
  Eigen::Vector3d At(double t);

 private:
  struct Eddy {
    double start, length;  // s
    Eigen::Vector3d peak;  // rad/s^2
  };

  double rms_;
  Random random_;
  double next_ = -kLongest;  // s, when the next eddy starts
  std::vector<Eddy> eddies_;

  static constexpr double kLongest = 2.0;  // s
};

}  // namespace trueline::simulation
