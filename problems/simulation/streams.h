// Sensors that are sampled from the true flight afterwards, each at its own rate and declared once
// in a catalogue: a section of the configuration with its numbers, and the samples that it logs.
#pragma once

#include <functional>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/simulation/flight.h"

namespace trueline::simulation {

// One sample to be taken.
struct SensorInstant {
  double t;  // s
  const SimulationConfig& config;
  const std::map<std::string, double>& settings;  // the sensor's own
  const Trajectory& truth;
  Random* random;  // the sensor's own
};

struct SensorDefinition {
  std::string id;  // of the configuration's section
  // Defaults of `rate` (Hz; 0: not logged) and of the other numbers, with their units.
  std::vector<EffectParameter> parameters;
  std::function<void(const SensorInstant&, FlightLog*)> sample;
};

const std::vector<SensorDefinition>& SampledSensors();

// Adds the streams of all sampled sensors, with noise drawn from `seed`.
void LogSensors(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
                FlightLog* log);

// The AHRS's attitude, delayed by the effects' latency.
void LogAttitude(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
                 FlightLog* log);

// The fixes of the satellite receiver, in place of the log's fixes and gates.
void LogGnss(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
             std::uint64_t seed, FlightLog* log);

// A pose sensor's sample of the pose `p_E`, `q_E` at `t` (s); sigmas in m and rad.
PoseSample MeasurePose(double t, const Vector3d& p_E, const Quaterniond& q_E, double position_sigma,
                       double attitude_sigma, Random* random);

// What a flight controller does to the streams before it logs them: filters and delays. Real logs
// have both; the vehicle itself flies on the raw readings.

// Passes the gyroscope through a causal Butterworth low-pass of second order (bilinear transform,
// Oppenheim & Schafer, Discrete-Time Signal Processing, sec. 7.1). `cutoff` in Hz, above 0 and
// below half the rate of `imu`. Slow motion comes late by 0.225 / cutoff.
void LowPassGyro(double cutoff, std::vector<ImuSample>* imu);

// Stamps the samples this much (s) after they were taken.
void StampLater(double delay, std::vector<ChannelsSample>* samples);

}  // namespace trueline::simulation
