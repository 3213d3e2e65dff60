// How well fixes agree with mocap, and whether a repair makes them agree better. A gate that stands
// off the map moves its own fixes; a clock, turned axes or a scale move the fixes of all gates.
#pragma once

#include <vector>

#include "problems/inspection/examination.h"

namespace trueline {

// Removes the fixes of gates that differ from mocap by far more than those of the other gates, at
// the lag that suits most fixes. A note names each gate and its displacement.
void LeaveOutGatesApart(Examination* e);

// Whether `change` of the fixes makes their median distance from mocap clearly smaller in both
// halves of the flight, and explains more than a displacement of each gate does. Where it is of
// some fixes, these must then agree with mocap as well as the others.
bool BringsFixesToMocap(const Examination& e, const StreamRepair& change);
// The same of fixes before and after any change, one for one those of `e.fixed`.
bool BringsFixesToMocap(const Examination& e, const std::vector<Fix>& before,
                        const std::vector<Fix>& after);

}  // namespace trueline
