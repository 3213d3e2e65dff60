// Whether the accelerometer's x and y read the lateral part of the body's force.
#pragma once

#include <string>
#include <vector>

#include "problems/inspection/examination.h"

namespace trueline {

// Drag is read from these axes and from nothing else. Their part of the acceleration is small
// beside that of thrust, so a wrong one hardly shows in the residual of all axes. Where the
// flight shows both, finds and repairs x and y exchanged or of the other sign; finds an axis that
// reads another multiple of the force: these findings are returned, since a scale of all axes may
// explain them. `stream`: of the positions, with an attitude.
std::vector<Finding> CheckLateralAxes(Examination* e, const std::string& stream);

}  // namespace trueline
