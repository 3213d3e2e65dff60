// How far drag may be off because the velocity that it is held against is an estimate, too.
//
// The accelerometer's x and y show drag by how they follow the velocity. Where the velocity
// changes by little more than it is known to, that relation is attenuated (errors in variables):
// in closed loop a vehicle moves sideways less than its AHRS's drift would allow, and no
// covariance of the fit shows that.
#pragma once

#include <Eigen/Core>
#include <array>

#include "problems/vgd/vgd_options.h"

namespace trueline {

class DragDoubt {
 public:
  // A stretch with `samples` of the accelerometer: velocity in body axes x, y (m/s) and its
  // posterior variance.
  void Add(const Eigen::Vector2d& v_B, const Eigen::Vector2d& variance, int samples);

  // Another flight's, or a share of it.
  void Add(const DragDoubt& other, double share = 1.0);

  // Sigma (1/s) to be added to each of K_x, K_y in quadrature. drag: the usual size of K_x, K_y
  // (1/s). variance: posterior, of K_x, K_y ((1/s)^2). force_sigma: of a sample (m/s^2).
  Eigen::Vector2d Sigma(const Eigen::Vector2d& drag, const Eigen::Vector2d& variance,
                        double force_sigma) const;

  // Whether the velocity along x, y moves by clearly more than it is known to. Where it does not,
  // the accelerometer's relation to it says more of errors than of drag.
  std::array<bool, 2> ShowsDrag() const;
  bool ShowsAllDrag() const { return ShowsDrag()[0] && ShowsDrag()[1]; }

  // m/s, root mean squares around the mean: what moves, and how well it is known.
  Eigen::Vector2d Spread() const;
  Eigen::Vector2d Uncertainty() const;

 private:
  double samples_ = 0.0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance_ = Eigen::Vector2d::Zero();
};

// Makes the variance of an unknown at least that, and what hangs on it as doubtful.
void Widen(int unknown, double variance, Eigen::MatrixXd* cov);

// Adds what is doubtful of K_x and K_y to the covariance of all parameters, in units of `unit` (a
// sigma before the flight), with K_x and K_y first. No parameter gets less certain than its unit.
void WidenDrag(const DragDoubt& doubt, const VgdOptions& options, double force_sigma,
               const Eigen::VectorXd& unit, Eigen::MatrixXd* cov);

}  // namespace trueline
