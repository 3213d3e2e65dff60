// Integral of a sampled signal over time, for means over any span without resampling the samples.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

namespace trueline {

// On a grid of `step` seconds; linear between. Signals of N numbers.
template <int N>
class RunningIntegral {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;

  RunningIntegral() = default;

  // Samples are joined by straight lines; a step above `max_gap` (s) is a gap, over which nothing
  // is known.
  RunningIntegral(double step, double max_gap) : step_(step), max_gap_(max_gap) {}

  // Appends a sample; `t` (s) increases. Samples are not kept, because an hour has millions.
  void Add(double t, const Vector& value) {
    if (samples_ == 0) begin_ = t;
    if (samples_ > 0) IntegrateTo(t, value);
    ++samples_;
    last_t_ = t;
    last_ = value;
  }

  // The integral of the integral.
  RunningIntegral Integrated() && {
    Vector before = Vector::Zero(), sum = Vector::Zero();
    for (std::size_t k = 0; k < integral_.size(); ++k) {
      if (k > 0) sum += 0.5 * step_ * (before + integral_[k]);
      before = integral_[k];
      integral_[k] = sum;
    }
    return std::move(*this);
  }

  // Whether [from, to] lies inside the samples and holds no gap.
  bool Knows(double from, double to) const {
    if (integral_.size() < 2 || from < begin_ || to >= Time(integral_.size() - 1)) return false;
    return gaps_[Index(from)] == gaps_[Index(to) + 1];
  }
  // For known times only.
  Vector At(double t) const {
    const std::size_t k = Index(t);
    const double share = (t - Time(k)) / step_;
    return (1.0 - share) * integral_[k] + share * integral_[k + 1];
  }
  Vector Mean(double from, double to) const { return (At(to) - At(from)) / (to - from); }

 private:
  double Time(std::size_t k) const { return begin_ + static_cast<double>(k) * step_; }
  std::size_t Index(double t) const {
    return std::min(static_cast<std::size_t>((t - begin_) / step_), integral_.size() - 2);
  }

  void IntegrateTo(double t, const Vector& value) {
    const double span = t - last_t_;
    const Vector slope = (value - last_) / span;
    if (span > max_gap_) ++gap_count_;
    for (double grid = Time(integral_.size()); grid <= t; grid = Time(integral_.size())) {
      const double dt = grid - last_t_;
      integral_.push_back(until_last_ + dt * last_ + 0.5 * dt * dt * slope);
      gaps_.push_back(gap_count_);
    }
    until_last_ += 0.5 * span * (last_ + value);
  }

  double begin_ = 0.0;
  double step_ = 1.0;
  double max_gap_ = 0.0;
  std::vector<Vector> integral_;  // at the points of the grid
  std::vector<int> gaps_;         // before each
  std::size_t samples_ = 0;
  double last_t_ = 0.0;
  Vector last_ = Vector::Zero();
  Vector until_last_ = Vector::Zero();  // integral up to the last sample
  int gap_count_ = 0;
};

}  // namespace trueline
