// Shared by windows and whole flights: segments with their nodes, and the steps between them.
#pragma once

#include <memory>

#include "problems/vgd/segment.h"
#include "problems/vgd/window_data.h"

namespace trueline {

// The segment [from, to] of a window. A measurement at a knot belongs to the segment that begins
// there, so a window cut at the knot contains it once; one at the window's end belongs to the last
// segment.
std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block);

// Divides [from, to] evenly into steps of at most `interval` seconds; both ends are knots.
std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval);

// L^-1 for the covariance L L' that the processes add to (p, v, drift) in `seconds`.
Matrix9d StepSqrtInformation(const ProcessNoise& noise, double seconds, double gravity);

}  // namespace trueline
