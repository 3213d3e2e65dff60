// Initial values of fits: the moving states at each pose, from poses and gyro alone.
#pragma once

#include <vector>

#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// One node for each pose. Position is the pose's less the lever arm of the pose sensor, velocity a
// difference over about 0.1 s, rate the mean of the gyro within 10 ms.
std::vector<RotorNode> RoughNodes(const RotorData& data, const RotorConstants& constants);

}  // namespace trueline
