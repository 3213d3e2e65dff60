// Uncertainty of drag from errors of the estimated velocity (errors in variables) and from gusts.
//
// Drag is estimated from the correlation of the accelerometer's x and y with the velocity. Where
// the velocity changes by little more than its own uncertainty, the slope is attenuated: in closed
// loop a vehicle moves sideways less than its AHRS's drift would allow. A gust pushes the vehicle
// and gives it a velocity in its own direction, which reads like less drag: within its memory tau a
// gust of size sigma gives sigma tau. The covariance of the fit includes neither.
#pragma once

#include <Eigen/Core>
#include <array>

#include "problems/vgd/vgd_options.h"

namespace trueline {

class DragErrors {
 public:
  // Adds a stretch with `samples` accelerometer samples: velocity in body axes x, y (m/s), its
  // posterior variance, and the size of the velocity that gusts make (m/s).
  void Add(const Eigen::Vector2d& v_B, const Eigen::Vector2d& variance, double by_gusts,
           int samples);

  // Adds another flight's statistics, or a share of them.
  void Add(const DragErrors& other, double share = 1.0);

  // The sigma (1/s) to add to that of K_x, K_y in quadrature. drag: their usual sizes (1/s).
  // variance: their posterior variances ((1/s)^2). force_sigma: of an accelerometer sample (m/s^2).
  Eigen::Vector2d Sigma(const Eigen::Vector2d& drag, const Eigen::Vector2d& variance,
                        double force_sigma) const;

  // For x and y: true if the velocity varies by clearly more than its uncertainty. If not, the
  // slope reflects errors of the velocity rather than drag.
  std::array<bool, 2> ShowsDrag() const;

  // Root mean squares, m/s: the velocity about its mean, its uncertainty, and that with gusts.
  Eigen::Vector2d Spread() const;
  Eigen::Vector2d Uncertainty() const;
  Eigen::Vector2d Uncommanded() const;

 private:
  double samples_ = 0.0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d squares_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d variance_ = Eigen::Vector2d::Zero();
  double gusts_ = 0.0;  // sum of squares
};

// Raises the variance of an unknown to at least `variance` and widens all unknowns correlated with
// it.
void Widen(int unknown, double variance, Eigen::MatrixXd* cov);

// Adds the drag uncertainty to the covariance of all parameters, in units of `unit` (prior sigmas),
// in the order of theta. No parameter's sigma rises above its unit, or above what it was where the
// fit has no priors.
void WidenDrag(const DragErrors& drag_errors, const VgdOptions& options, double force_sigma,
               const Eigen::VectorXd& unit, Eigen::MatrixXd* cov);

// The values that go with a covariance of drag that was widened from `cov` to `wider`: with less
// information from the data the drag returns to its prior's mean, and what is correlated with it
// follows. deviation: from the priors' means; all in units of the prior sigmas. Unchanged where the
// fit has no priors.
Eigen::VectorXd ReturnDrag(const VgdOptions& options, const Eigen::MatrixXd& cov,
                           const Eigen::MatrixXd& wider, Eigen::VectorXd deviation);

}  // namespace trueline
