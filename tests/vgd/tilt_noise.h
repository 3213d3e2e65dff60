// An attitude's tilt error that comes and goes.
#pragma once

#include <cmath>
#include <vector>

#include "cost_functions/models/rotation.h"
#include "problems/common/random.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Turns each sample by an Ornstein-Uhlenbeck process of `sigma` (rad, of roll and pitch of E') and
// `memory` (s).
inline void AddTiltNoise(double sigma, double memory, std::vector<AttitudeSample>* attitude) {
  Random random(1, "tilt");
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  TimeNs last = attitude->front().t;
  for (AttitudeSample& sample : *attitude) {
    const double decay = std::exp(-SecondsBetween(last, sample.t) / memory);
    const Eigen::Vector3d drawn = random.NormalVector3();
    error = decay * error + sigma * std::sqrt(1.0 - decay * decay) * drawn;
    error.z() = 0.0;
    last = sample.t;
    sample.q_Ep_I = QuaternionFromEuler<double>(error) * sample.q_Ep_I;
  }
}

}  // namespace trueline
