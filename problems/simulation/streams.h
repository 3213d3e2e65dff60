// Sensors that are sampled from the true flight afterwards. Those of a steady rate are declared
// once in a catalogue: a section of the configuration with its numbers, and the samples that they
// log. The camera that detects gates samples where they are in view.
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

// A stretch of flight during which one gate is in view.
struct GateView {
  int gate;           // index into the map
  double start, end;  // s
};

// Detects gates and converts detections to position fixes.
class GateCamera {
 public:
  GateCamera(const DetectorConfig& config, const std::vector<Gate>& map, const Stages& stages,
             std::uint64_t seed);

  // All views within the log's time. If several gates are in view, the nearest one counts.
  std::vector<GateView> Views(const Trajectory& truth) const;
  // Fixes of the log's time, strictly increasing stamps.
  std::vector<Fix> Fixes(const Trajectory& truth);

 private:
  int VisibleGate(const TruthSample& sample) const;  // -1: none
  bool Sees(const TruthSample& sample, int gate) const;
  Fix Measure(const Trajectory& truth, int gate, double t);
  Vector3d Noise(double sigma);

  DetectorConfig config_;
  std::vector<Gate> map_;
  std::vector<Vector3d> standing_;  // true places of the gates, m in E
  const Stages& stages_;
  double latency_;
  Random times_, noise_, outliers_, jitter_, false_gates_;
};

}  // namespace trueline::simulation
