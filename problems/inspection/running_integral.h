// Integral of a sampled signal over time, for means over any span without resampling the samples.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace trueline {

// On a grid of `step` seconds; linear between. Signals of N numbers.
template <int N>
class RunningIntegral {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;

  RunningIntegral() = default;

  // Samples are joined by straight lines; a step above `max_gap` (s) is a gap, over which nothing
  // is known. `times` increase.
  RunningIntegral(const std::vector<double>& times, const std::vector<Vector>& values, double step,
                  double max_gap)
      : begin_(times.front()), step_(step) {
    const auto size = static_cast<std::size_t>((times.back() - begin_) / step) + 1;
    integral_.reserve(size);
    gaps_.reserve(size);
    Vector until = Vector::Zero();  // integral up to sample i
    int gaps = 0;
    for (std::size_t i = 0, k = 0; i + 1 < times.size(); ++i) {
      const double span = times[i + 1] - times[i];
      const Vector slope = (values[i + 1] - values[i]) / span;
      if (span > max_gap) ++gaps;
      for (; k < size && Time(k) <= times[i + 1]; ++k) {
        const double dt = Time(k) - times[i];
        integral_.push_back(until + dt * values[i] + 0.5 * dt * dt * slope);
        gaps_.push_back(gaps);
      }
      until += 0.5 * span * (values[i] + values[i + 1]);
    }
  }

  // The integral of the integral.
  RunningIntegral Again() const {
    RunningIntegral again = *this;
    if (!integral_.empty()) again.integral_[0].setZero();
    for (std::size_t k = 1; k < integral_.size(); ++k) {
      again.integral_[k] = again.integral_[k - 1] + 0.5 * step_ * (integral_[k - 1] + integral_[k]);
    }
    return again;
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

  double begin_ = 0.0;
  double step_ = 1.0;
  std::vector<Vector> integral_;
  std::vector<int> gaps_;
};

}  // namespace trueline
