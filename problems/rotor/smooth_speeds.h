// Measured rotor speeds have noise: an ESC counts commutations, and a log rounds. A model that
// takes them for exact finds too large an inertia, since the noise scatters the moments that are
// compared with the body's acceleration (errors in variables). The mean of a speed given all its
// samples has an error that does not correlate with it; a fit to it is unbiased (regression
// calibration, Carroll et al., Measurement Error in Nonlinear Models, 2006, ch. 4), as far as the
// speeds move as assumed. Speeds change fast in manoeuvres and slowly between them, so a bias is
// left, which WithoutSpeedNoiseBias removes.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

// A speed that walks at random, as does its rate, and its measurement with white noise.
struct SpeedWalk {
  double noise;  // (rad/s)^2, variance of a sample
  double speed;  // (rad/s)^2/s
  double rate;   // (rad/s^2)^2/s
};

// How speeds move. Rotors move together: thrust changes all speeds, a moment only their
// differences, which are smaller. So each principal component of the changes has its own walk. All
// have the same noise.
struct SpeedModel {
  double sigma = 0.0;            // rad/s, noise of a sample; 0: the speeds are exact
  Eigen::MatrixXd components;    // orthonormal columns, by rotor
  std::vector<SpeedWalk> walks;  // of each component
};

// The model of the greatest likelihood, given the speeds (rad/s, by time, then rotor) at times `t`
// (s). Noise below a thousandth of the speeds counts as none.
SpeedModel LearnSpeedModel(const std::vector<double>& t, const Eigen::MatrixXd& speeds);

// Means of the speeds given all samples. The means of what is left are added `again` times
// (twicing, Tukey, Exploratory Data Analysis, 1977): more of fast changes is kept, and more noise.
Eigen::MatrixXd SmoothSpeeds(const std::vector<double>& t, const Eigen::MatrixXd& speeds,
                             const SpeedModel& model, int again = 0);

}  // namespace trueline
