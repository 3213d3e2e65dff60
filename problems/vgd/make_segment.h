// What windows and whole flights share: segments with their nodes, and the steps between them.
#pragma once

#include <memory>

#include "problems/vgd/segment.h"
#include "problems/vgd/window_data.h"

namespace trueline {

// The segment [from, to] of a window. What is measured at a knot belongs to the segment that begins
// there (so that a window cut at the knot holds it once), at the window's very end to the last one.
std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block);

// Knots that divide [from, to] evenly into steps of at most `interval` seconds, both ends included.
std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval);

// L^-1 of the covariance L L' of the step (p, v, drift) that the processes build up in `seconds`.
Matrix9d StepSqrtInformation(const ProcessNoise& noise, double seconds, double gravity);

}  // namespace trueline
