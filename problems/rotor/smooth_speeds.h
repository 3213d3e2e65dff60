// Measured rotor speeds have noise: an ESC counts commutations, and a log rounds. A model that
// takes them for exact finds too large an inertia, since the noise scatters the moments that are
// compared with the body's acceleration (errors in variables). The mean of a speed given all its
// samples has an error that does not correlate with it; a fit to it is unbiased (regression
// calibration, Carroll et al., Measurement Error in Nonlinear Models, 2006, ch. 4).
#pragma once

#include <vector>

namespace trueline {

struct SmoothedSpeeds {
  std::vector<std::vector<double>> speeds;  // rad/s, by time, then rotor
  double sigma = 0.0;                       // rad/s, noise of a sample; 0: exact
};

// Means of the speeds given all samples, where speeds and their rates walk at random. Rotors move
// together: thrust changes all speeds, a moment only their differences, which are smaller. So each
// principal component of the changes has its own walk. All have the same noise. Noise and walks are
// of the greatest likelihood. Noise below a thousandth of the speeds is left as it is. `t` in s,
// `speeds` in rad/s by time, then rotor.
SmoothedSpeeds SmoothSpeeds(const std::vector<double>& t,
                            const std::vector<std::vector<double>>& speeds);

}  // namespace trueline
