// The entries of `forces:` that the simulator flies. Terms of the open catalogue have the names of
// model.yaml (problems/effects/effect.h) and the simulator's own physics. Forces that no effect of
// the catalogue states, for tests of the diagnosis, go with how the vehicle moves, or act at a
// place.
//
//   forces:
//     - {id: term, where: force_x, with: q*v_x, size: 0.1, unit: m/s^2 for each rad/s m/s}
//     - {along: x_B, goes_with: pitch rate, size: 0.5}      # m/s^2 for each rad/s
//     - {along: y_B, goes_with: yaw rate * forward speed, size: 0.1}
//     - {along: east, place: [8, 2], radius: 2, size: 1.5}  # m; half the size at the radius
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/random.h"
#include "problems/common/strict_yaml.h"
#include "problems/effects/effect.h"
#include "problems/simulation/airframe.h"
#include "problems/simulation/effects.h"

namespace trueline::simulation {

// Throws InputError for a term that is not known, or that cannot be flown: an error of a sensor,
// and what goes with the battery's voltage.
Effect ReadFlownTerm(const YamlMap& entry);

// A force or an angular acceleration, computed at every step of the integration.
void AddTerm(const Effect& term, Stages* stages);

// Throws InputError for an unknown axis or variable. Entries with an `id: term` are those of a
// model.yaml; they go to `effects`.
std::vector<UnnamedForce> ReadUnnamedForces(const YamlMap& map, std::vector<Effect>* effects);

// An entry of `forces`, as it is read.
YAML::Node ToYaml(const UnnamedForce& force);

// Specific force on the vehicle in E, m/s^2.
Vector3d ForceOf(const std::vector<UnnamedForce>& forces, const BodyState& state);

// Moments that a log does not show and an autopilot has to hold against: eddies that meet the
// vehicle at random times, each with a random turn about a random axis that rises and falls as a
// raised cosine. Not a Gauss-Markov process, which the estimators assume (RotorNoise): few eddies
// act at a time, so sizes have heavy tails, and the spectrum falls faster.
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
