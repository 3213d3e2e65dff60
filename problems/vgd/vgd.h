// VGD (Li et al. 2019): for every pass, the model is fitted to the last gamma passes and predicts
// the arc that follows.
#pragma once

#include "problems/result/estimate.h"
#include "problems/vgd/vgd_options.h"
#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Runs over all windows in time order; each starts from the optimum before it. Windows never
// reach over an IMU gap: they get shorter, and an arc with a gap in it is not predicted.
// `processes`: by window, as LearnProcess gives them.
EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options,
                    const std::vector<ProcessNoise>& processes);
EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options);

// One window on its own: passes tau - gamma + 1 ... tau (from 1). `start` replaces the priors'
// means as the point where the search begins.
WindowEstimate SolveWindow(const FlightData& flight, const VgdOptions& options, int tau,
                           const Theta& start);

// The same window from `count` starts drawn from the ranges of Table 2 (the priors' mean +-
// sqrt(3) sigma: sigma is that of the uniform distribution over the range). Iterations are those
// until options.tolerance; optima are compared where each search has come to rest.
struct StartStudy {
  int starts = 0;
  int same_optimum = 0;         // within a tenth of a sigma in every parameter of the best
  std::vector<int> iterations;  // by start
  std::vector<double> costs;    // by start
};
StartStudy StudyStarts(const FlightData& flight, const VgdOptions& options, int tau, int count,
                       std::uint64_t seed);

// The priors' means: where a search begins if nothing better is known.
Theta PriorMeans(const VgdOptions& options);

}  // namespace trueline
