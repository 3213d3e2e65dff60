// Trajectories in YAML: as a configuration states them, and as a design writes them.
#pragma once

#include <cstdint>

#include "problems/common/strict_yaml.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/limits.h"

namespace trueline {

// kind: hover | lissajous | random | file. duration [s]; amplitude, frequency [Hz], phase [rad] of
// x, y, z [m] and yaw [rad] (lissajous); seed (random); file (a trajectory.yaml).
PiecewisePolynomial ReadTrajectory(const YamlMap& map, const RotorVehicle& vehicle,
                                   const FlightLimits& limits);

// travel [m], rate [rad/s], tilt [rad], min_speed and max_speed [rad/s] or, with _rpm, in rpm; roll
// and pitch [rad]: if one is given and tilt is not, tilt has no limit of its own.
FlightLimits ReadLimits(const YamlMap& map);

// breaks and coefficients, as trueline-design writes them and `kind: file` reads them.
std::string TrajectoryYaml(const PiecewisePolynomial& path);
PiecewisePolynomial TrajectoryOf(const YamlMap& map);
PiecewisePolynomial ReadTrajectoryFile(const std::filesystem::path& file);

// States and rotor speeds at `rate` Hz as CSV, columns `name [unit]`.
std::string TrajectoryCsv(const RotorFlight& flight, double rate);

}  // namespace trueline
