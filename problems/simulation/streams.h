// Streams that are sampled from the true flight afterwards, each at its own rate. A rate of 0 omits
// the stream.
#pragma once

#include "problems/simulation/trajectory.h"

namespace trueline::simulation {

// A pose sensor's sample of the pose `p_E`, `q_E` at `t` (s); sigmas in m and rad.
PoseSample MeasurePose(double t, const Vector3d& p_E, const Quaterniond& q_E, double position_sigma,
                       double attitude_sigma, Random* random);

// The AHRS's attitude, delayed by the effects' latency.
void LogAttitude(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
                 FlightLog* log);
void LogMocap(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log);
// Measured rotor speeds, and the commands as a share of the greatest speed.
void LogRotors(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
               FlightLog* log);
// Distance to the floor along B's z axis.
void LogRange(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log);

}  // namespace trueline::simulation
