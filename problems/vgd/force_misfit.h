// How strongly the misfits of the accelerometer's x and y are correlated in time.
//
// A fit counts the short means of the accelerometer as independent. Vibration that the sample rate
// folds to low frequencies, and forces with a memory of their own, change little from one mean to
// the next, so many of them tell less than the fit believes. The mean of n samples with
// autocovariance c_k has the variance (c_0 + 2 sum c_k) / n (Bartlett): independent samples of that
// variance tell as much.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace trueline {

class ForceMisfit {
 public:
  // Adds a window's misfits (m/s^2), in order of time. `apart`: s between samples.
  void Add(const std::vector<Eigen::Vector2d>& misfits, double apart);

  // The factor on `sigma` (m/s^2, of a sample) with which independent samples tell as little; at
  // least 1.
  double Scale(double sigma) const;

 private:
  double weight_ = 0.0;  // samples of all windows, both axes
  double sum_ = 0.0;     // of their variance at frequency zero, (m/s^2)^2
};

}  // namespace trueline
