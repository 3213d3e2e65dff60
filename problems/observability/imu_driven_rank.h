// The exact observability of the model of Li et al. 2019: which of its nine parameters are
// observable from position fixes.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/observability/imu_driven_system.h"
#include "problems/observability/rank.h"

namespace trueline {

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

}  // namespace trueline
