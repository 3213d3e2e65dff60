// VGD (Li et al. 2019): for every pass, the model is fitted to the last gamma passes and predicts
// the arc that follows.
#pragma once

#include <vector>

#include "problems/common/random.h"
#include "problems/result/estimate.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// For each pass tau the process (index tau - 1) of the window that ends there, learned from the
// flight up to it. It does not depend on the window's length, so it is learned once for all
// estimators. options.process throughout if options.adapt_drift is off.
std::vector<ProcessNoise> LearnProcess(const FlightData& flight, const VgdOptions& options);

// Runs over all windows in time order; each starts where options.start says. A window
// never spans an IMU gap: it is shortened, and an arc with a gap is not predicted. `processes`: one
// for each window, as LearnProcess returns them.
EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options,
                    const std::vector<ProcessNoise>& processes);
EstimatorRun RunVgd(const FlightData& flight, const VgdOptions& options);

// One window alone: passes tau - gamma + 1 ... tau (from 1). The search begins at `start`, or at
// the priors' means.
WindowEstimate SolveWindow(const FlightData& flight, const VgdOptions& options, int tau,
                           const Theta& start);

// The same window from `count` random starts. Iterations are counted until
// options.tolerance; optima are compared at convergence.
struct StartStudy {
  int starts = 0;
  int same_optimum = 0;         // within a tenth of a sigma in every parameter of the best
  std::vector<int> iterations;  // by start
  std::vector<double> costs;    // by start
};
StartStudy StudyStarts(const FlightData& flight, const VgdOptions& options, int tau, int count,
                       std::uint64_t seed);

// Drawn from the ranges (the priors' mean +- sqrt(3) sigma: sigma is that of the uniform
// distribution over the range).
Theta RandomStart(const VgdOptions& options, Random* random);

// The priors' means: the default start of a search.
Theta PriorMeans(const VgdOptions& options);

// A position that a window predicts at a fixed time after its last fix, against mocap. How often
// the regions of such forecasts hold the truth on measured flight tells whether the stated
// uncertainty can be believed.
struct Forecast {
  double horizon;  // s after the window's last fix
  double error;    // m, horizontal
  double sigma;    // m, root of the mean variance of the two axes
  // Probability of the forecast's ellipse through the truth: uniform in [0, 1] where errors are as
  // large as stated.
  double rank;
};

// Of the window that ends with pass `tau` (from 1), for each of `horizons` (s) that lies on the arc
// after it and that mocap covers. `start` as of SolveWindow. The window is solved anew with the
// accelerometer up to the horizon alone. None on a flight whose fixes have correlated noise: its
// positions count from the last fix, and mocap's do not.
std::vector<Forecast> ForecastAfter(const FlightData& flight, const VgdOptions& options, int tau,
                                    const Theta& start, const std::vector<double>& horizons);

}  // namespace trueline
