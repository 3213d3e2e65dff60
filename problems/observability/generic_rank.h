// The exact rank of a system, at random points.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/observability/imu_driven_system.h"
#include "problems/observability/rank.h"
#include "problems/observability/rotor_driven_system.h"

namespace trueline {

// The exact observability of the model of Li et al. 2019: which of its nine parameters are
// observable from position fixes.

// The vehicle's rotation during the flight.
enum class Turning {
  kAny,    // roll, pitch and yaw vary
  kNoYaw,  // roll and pitch vary, heading does not
  kPitch,  // only pitch varies: straight ahead and back
  kNone    // attitude is constant
};

// As RotorDrivenRank. Thrust varies except for kNone, where it is constant.
RankReport ImuDrivenRank(const ImuDrivenSystem& system, const std::vector<int>& states,
                         Turning turning, std::uint64_t seed = 0);

// The exact observability of the rotor-driven model (Boehm et al. 2020, table I), by its motion.
enum class Motion {
  kVarying,   // any state, inputs that vary
  kConstant,  // any state, constant inputs
  kHover,     // trim: no rotation, no acceleration, any constant velocity
  kVertical,  // straight up and down
  kStraight   // in the vertical plane of the body's x axis, pitching
};

// Rank and null space for `states` (error states; all others are known), with null vectors in
// physical units at a point near `nominal` (kStates numbers). The rank is the larger one of two
// random points; it is wrong with a probability below 1e-14. Throws InputError if the vehicle
// cannot fly the motion.
RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed = 0);

}  // namespace trueline
