#include "problems/simulation/streams.h"

#include <algorithm>

namespace trueline::simulation {

PoseSample MeasurePose(double t, const Vector3d& p_E, const Quaterniond& q_E, double position_sigma,
                       double attitude_sigma, Random* random) {
  const Vector3d shift = position_sigma * random->NormalVector3();
  const Vector3d turn = attitude_sigma * random->NormalVector3();
  return {FromSeconds(t), p_E + shift, q_E * RotationByVector(turn)};
}

void LogAttitude(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
                 FlightLog* log) {
  double latency = 0.0;
  Apply(stages.attitude_latency, &latency);
  const double rate = config.ahrs.rate > 0.0 ? config.ahrs.rate : config.imu.rate;
  for (const double t : StreamTimes(rate, config.duration)) {
    log->attitude.push_back({FromSeconds(t), truth.At(t - latency).q_Ep_I});
  }
}

void LogMocap(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log) {
  if (config.mocap.rate <= 0.0) return;
  Random random(seed, "mocap");
  for (const double t : StreamTimes(config.mocap.rate, config.duration)) {
    const TruePose pose = truth.At(t);
    log->mocap.push_back(MeasurePose(t, pose.p_E, pose.q_E_B, config.mocap.position_sigma,
                                     config.mocap.attitude_sigma, &random));
  }
}

void LogRotors(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
               FlightLog* log) {
  if (config.rotors.rate <= 0.0) return;
  log->vehicle = Vehicle{config.vehicle.mass, config.vehicle.rotors};
  Random random(seed, "rotors");
  for (const double t : StreamTimes(config.rotors.rate, config.duration)) {
    const TruthSample& now = truth.Nearest(t);
    ChannelsSample speeds{FromSeconds(t), {}}, commands{FromSeconds(t), {}};
    for (const double w : now.rotors)
      speeds.values.push_back(w + config.rotors.sigma * random.Normal());
    for (const double w : now.command)
      commands.values.push_back(w / config.vehicle.max_rotor_speed);
    log->rotors.push_back(speeds);
    log->motors.push_back(commands);
  }
}

void LogRange(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log) {
  if (config.range.rate <= 0.0) return;
  Random random(seed, "range");
  for (const double t : StreamTimes(config.range.rate, config.duration)) {
    const TruePose pose = truth.At(t);
    const double slant = (pose.q_E_B * Vector3d::UnitZ()).z();
    const double noise = config.range.sigma * random.Normal();
    log->range.push_back({FromSeconds(t), -pose.p_E.z() / std::max(slant, 0.1) + noise});
  }
}

}  // namespace trueline::simulation
