// Forecasts: positions that a window predicts at fixed times after its last fix, against mocap. How
// often their regions hold the truth on measured flight tells whether the stated uncertainty can be
// believed.
#pragma once

#include <vector>

#include "problems/vgd/vgd.h"

namespace trueline {

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
