// Where fits start from: the moving states at each pose, from poses and gyro alone.
#pragma once

#include <vector>

#include "problems/rotor_data/rotor_data.h"
#include "problems/rotor_data/rotor_state.h"

namespace trueline {

// One node for each pose. Positions less the lever of the pose sensor, velocities by differences
// over about 0.1 s, rates by the mean of the gyro within 10 ms.
std::vector<RotorNode> RoughNodes(const RotorData& data, const RotorConstants& constants);

}  // namespace trueline
