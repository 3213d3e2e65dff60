// The loop of every simulated flight: the drone is flown from one IMU sample to the next.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "problems/common/units.h"
#include "problems/simulation/airframe.h"
#include "problems/simulation/imu.h"

namespace trueline::simulation {

// The true flight, stored at the IMU's rate and evaluated at any time.
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

// Path errors, accumulated during the flight.
struct PathErrors {
  double squares = 0.0, largest = 0.0;
  int count = 0;

  void Note(double error) {
    squares += error * error;
    largest = std::max(largest, error);
    ++count;
  }
  double Rms() const { return std::sqrt(squares / std::max(1, count)); }
};

// Times of a stream of `rate` Hz from 0 to `duration` s.
std::vector<double> StreamTimes(double rate, double duration);

// What acts on the body beside its rotors and the effects.
struct Disturbance {
  Vector3d gust_E = Vector3d::Zero();   // m/s^2, specific force
  Vector3d twist_B = Vector3d::Zero();  // rad/s^2, angular acceleration
};

// What a pilot can use at a sample.
struct Instant {
  int k;         // counts the IMU's samples; negative in the warm-up, which is not logged
  double t, dt;  // s, from the start of the log; since the last sample
  const BodyState& state;
  const BodyRate& rate;
  const ImuReading& reading;
};

// Both are called once for each sample, the air first. What they return is held until the next one.
using Air = std::function<Disturbance(const BodyState&)>;
using Pilot = std::function<RotorArray(const Instant&)>;  // speeds that the rotors approach, rad/s

struct FlightSetup {
  VehicleConfig vehicle;
  ImuConfig imu;
  std::optional<AhrsConfig> ahrs;
  double gravity = 9.81;  // m/s^2
  Stages stages;
  int substeps = 1;  // of the physics between two samples
  int first = 0;     // samples first .. last are flown
  int last = 0;
  std::function<double(int)> time;       // s, of a sample
  std::function<void(double)> progress;  // told the seconds flown from time to time; optional
};

// Flies from `start` and logs the IMU. Noise is drawn from `seed`.
Trajectory RunFlight(const FlightSetup& setup, const BodyState& start, const Air& air,
                     const Pilot& pilot, std::uint64_t seed, FlightLog* log);

}  // namespace trueline::simulation
