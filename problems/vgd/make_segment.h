// Shared by windows and whole flights: segments with their nodes, and the steps between them.
#pragma once

#include <memory>

#include "cost_functions/continuity_residual.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/segment.h"

namespace trueline {

// The segment [from, to] of a window. A measurement at a knot belongs to the segment that begins
// there, so a window cut at the knot contains it once; one at the window's end belongs to the last
// segment.
std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block);

// Divides [from, to] evenly into steps of at most `interval` seconds; both ends are knots.
std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval);

// The process over a segment: decay, and weights by the covariance that it adds. drift_unit: rad
// for each unit of a node's drift.
ContinuityResidual::Weights StepWeights(const ProcessNoise& noise,
                                        const Eigen::Vector3d& drift_unit, const Segment& segment,
                                        double gravity);
// Log determinant of these weights, the gust's included if `gusts`.
double LogDeterminant(const ContinuityResidual::Weights& weights, bool gusts);

}  // namespace trueline
