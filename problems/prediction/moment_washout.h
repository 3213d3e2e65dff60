// Which part of the rotors' moment turns a vehicle that an autopilot holds.
//
// Below about 3 Hz the rotors mostly cancel moments that no log shows (gusts, a rotor's wake, a
// centre of mass that is off): integrated, their moment would turn the vehicle several times too
// far. Above, it turns the vehicle, somewhat late. Both are two linear filters of the rows before.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

// rad/s^2 or N m about roll and pitch, a column a row.
using LevelMoments = Eigen::Matrix<double, 2, Eigen::Dynamic>;

struct MomentWashout {
  double washout = 0.1;  // s, time constant of a high-pass of order two
  double lag = 0.01;     // s, time constant of a low-pass of order one

  // `moment` at the times t (s), by its past alone.
  LevelMoments Of(const LevelMoments& moment, const Eigen::VectorXd& t) const;
};

struct MomentRecord {
  Eigen::VectorXd t;  // s
  LevelMoments measured, modelled;
};

// The washout with which the modelled moments, times a share for each axis, are closest to the
// measured ones.
MomentWashout FitMomentWashout(const std::vector<MomentRecord>& flights);

// Regression of `measured` on `modelled` through the origin; 1 where nothing is modelled.
double ShareOf(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& modelled);

}  // namespace trueline
