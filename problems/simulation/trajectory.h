// The true flight, stored at the IMU's rate and evaluated at any time.
#pragma once

#include <vector>

#include "problems/common/units.h"
#include "problems/simulation/airframe.h"

namespace trueline {
namespace simulation {

struct TruthSample {
  double t;             // s, from the start of the log; negative in the warm-up
  Vector3d p_E, v_E;    // m, m/s
  Quaterniond q_E_B;    // takes a vector in B to E
  Vector3d w_B, dw_B;   // rad/s, rad/s^2
  Vector3d f_B;         // m/s^2, specific force at the origin of B
  Vector3d a_E;         // m/s^2, acceleration
  RotorArray rotors;    // rad/s
  RotorArray command;   // rad/s, held until the next sample
  double thrust;        // m/s^2, specific thrust
  Quaterniond q_Ep_I;   // the AHRS's attitude, without latency
  Vector3d accel_walk;  // m/s^2, random walk of the accelerometer's bias
};

struct TruePose {
  Vector3d p_E;
  Quaterniond q_E_B;
  Quaterniond q_Ep_I;
};

// Samples evenly spaced in time.
class Trajectory {
 public:
  explicit Trajectory(double rate) : rate_(rate) {}
  void Add(const TruthSample& sample) { samples_.push_back(sample); }

  const std::vector<TruthSample>& samples() const { return samples_; }
  double rate() const { return rate_; }
  double start() const { return samples_.front().t; }
  double end() const { return samples_.back().t; }
  // Position by cubic Hermite interpolation, attitudes by slerp; constant before start and after
  // end.
  TruePose At(double t) const;
  // The sample nearest to `t`.
  const TruthSample& Nearest(double t) const;

 private:
  double rate_;
  std::vector<TruthSample> samples_;
};

// Times of a stream of `rate` Hz from 0 to `duration` s.
std::vector<double> StreamTimes(double rate, double duration);

}  // namespace simulation
}  // namespace trueline
