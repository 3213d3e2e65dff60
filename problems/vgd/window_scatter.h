// Sigmas of constants, widened by how much the windows of a flight disagree.
//
// A window's covariance counts its noise as white, or with the memory that the options state. On a
// flight without gates nothing tells how far that holds: forces and vibration of a longer memory
// look like the vehicle's constants. But the vehicle's constants are the same in every window, so
// windows that share no data show the true scatter: by the Birge ratio, the root of the mean square
// of their differences in sigmas. It is taken together with an expectation of one, which counts as
// two windows, and only widens.
#pragma once

#include "problems/result/estimate.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Widens the parameters of every window by it and those before it that share no pass with each
// other. The AHRS's error is left as it is, since it changes over a flight. No sigma rises above
// the prior's.
void WidenByScatter(const VgdOptions& options, EstimatorRun* run);

}  // namespace trueline
