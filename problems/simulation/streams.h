// Streams that are sampled from the true flight afterwards, each at its own rate. A rate of 0 omits
// the stream.
#pragma once

#include "problems/simulation/trajectory.h"

namespace trueline::simulation {

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
