#include "problems/vgd/drag_errors.h"

#include <algorithm>
#include <cmath>

namespace trueline {

void DragErrors::Add(const Eigen::Vector2d& v_B, const Eigen::Vector2d& variance, double by_gusts,
                     int samples) {
  samples_ += samples;
  sum_ += samples * v_B;
  squares_ += samples * v_B.cwiseAbs2();
  variance_ += samples * variance;
  gusts_ += samples * by_gusts * by_gusts;
}

void DragErrors::Add(const DragErrors& other, double share) {
  samples_ += share * other.samples_;
  sum_ += share * other.sum_;
  squares_ += share * other.squares_;
  variance_ += share * other.variance_;
  gusts_ += share * other.gusts_;
}

Eigen::Vector2d DragErrors::Spread() const {
  if (samples_ == 0.0) return Eigen::Vector2d::Zero();
  return (squares_ / samples_ - (sum_ / samples_).cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
}

Eigen::Vector2d DragErrors::Uncertainty() const {
  if (samples_ == 0.0) return Eigen::Vector2d::Zero();
  return (variance_ / samples_).cwiseSqrt();
}

Eigen::Vector2d DragErrors::Uncommanded() const {
  if (samples_ == 0.0) return Eigen::Vector2d::Zero();
  return ((variance_.array() + gusts_) / samples_).sqrt();
}

std::array<bool, 2> DragErrors::ShowsDrag() const {
  constexpr double kClearly = 2.0;  // at least three quarters of the variance is motion
  const Eigen::Vector2d spread = Spread(), uncertainty = Uncertainty();
  return {spread[0] > kClearly * uncertainty[0], spread[1] > kClearly * uncertainty[1]};
}

Eigen::Vector2d DragErrors::Sigma(const Eigen::Vector2d& drag, const Eigen::Vector2d& variance,
                                  double force_sigma) const {
  const Eigen::Vector2d spread = Spread(), uncommanded = Uncommanded();
  Eigen::Vector2d sigma = Eigen::Vector2d::Zero();
  for (int i = 0; i < 2; ++i) {
    if (!(spread[i] > 0.0)) continue;
    const double attenuation = std::min(1.0, std::pow(uncommanded[i] / spread[i], 2));
    // The accelerometer's share of the information on K. The mean of v gives none: b_ax, b_ay are
    // free.
    const double information = samples_ * std::pow(spread[i] / force_sigma, 2);
    const double share = std::min(1.0, information * variance[i]);
    sigma[i] = std::abs(drag[i]) * attenuation * share;
  }
  return sigma;
}

void Widen(int unknown, double variance, Eigen::MatrixXd* cov) {
  const double known = (*cov)(unknown, unknown), added = variance - known;
  if (!(known > 0.0 && added > 0.0)) return;
  const Eigen::VectorXd along = cov->col(unknown) / known;
  *cov += added * along * along.transpose();
}

void WidenDrag(const DragErrors& drag_errors, const VgdOptions& options, double force_sigma,
               const Eigen::VectorXd& unit, Eigen::MatrixXd* cov) {
  if (!options.drag_measurement.enabled) return;
  Eigen::Vector2d drag, variance;
  for (int i = 0; i < 2; ++i) {
    const int k = kDragInTheta + i;
    drag[i] = options.priors[k].mean;
    variance[i] = unit[k] * unit[k] * (*cov)(k, k);
  }
  const Eigen::Vector2d sigma = drag_errors.Sigma(drag, variance, force_sigma);
  // A fit without priors may be wider than `unit` already.
  const Eigen::VectorXd most = cov->diagonal().cwiseMax(1.0);
  for (int i = 0; i < 2; ++i) {
    const int k = kDragInTheta + i;
    Widen(k, std::min((*cov)(k, k) + std::pow(sigma[i] / unit[k], 2), most[k]), cov);
  }
  const Eigen::VectorXd shrink =
      cov->diagonal().cwiseQuotient(most).cwiseMax(1.0).cwiseSqrt().cwiseInverse();
  *cov = (shrink.asDiagonal() * *cov * shrink.asDiagonal()).eval();
}

Eigen::VectorXd ReturnDrag(const VgdOptions& options, const Eigen::MatrixXd& cov,
                           const Eigen::MatrixXd& wider, Eigen::VectorXd deviation) {
  constexpr double kNone = 1e-6;  // of a prior's precision: the data say nothing
  if (options.ranges != RangeUse::kPrior) return deviation;
  for (const int k : {kDragInTheta, kDragInTheta + 1}) {
    const double variance = cov(k, k);
    if (!(variance > 0.0) || 1.0 - variance < kNone) continue;
    // A posterior variance of c under a unit prior leaves the data a weight of 1 - c.
    const double left = std::clamp((1.0 - wider(k, k)) / (1.0 - variance), 0.0, 1.0);
    deviation += (left - 1.0) * deviation[k] / variance * cov.col(k);
  }
  return deviation;
}

}  // namespace trueline
