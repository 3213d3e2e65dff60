// The exact observability of the model of Li et al. 2019: which of its nine parameters position
// fixes show.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/observability/imu_driven_system.h"
#include "problems/observability/rank.h"

namespace trueline {

// How the vehicle turns while it flies.
enum class Turning {
  kAny,    // roll, pitch and yaw vary
  kNoYaw,  // roll and pitch vary, heading does not
  kPitch,  // only pitch varies: straight ahead and back
  kNone    // attitude is constant
};

// As RotorDrivenRank. Thrust varies with all but kNone, where it is constant.
RankReport ImuDrivenRank(const ImuDrivenSystem& system, const std::vector<int>& states,
                         Turning turning, std::uint64_t seed = 0);

}  // namespace trueline
