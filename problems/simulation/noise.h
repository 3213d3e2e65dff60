// Noise processes in discrete time.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string_view>

#include "problems/common/random.h"

namespace trueline::simulation {

// An Ornstein-Uhlenbeck process with three independent axes: stationary standard deviation `sigma`
// and autocorrelation exp(-|dt| / memory). It starts from its stationary distribution. Exact for
// any step.
class OrnsteinUhlenbeck {
 public:
  OrnsteinUhlenbeck(const Eigen::Vector3d& sigma, double memory, std::uint64_t seed,
                    std::string_view stream)
      : sigma_(sigma), memory_(memory), random_(seed, stream) {
    value_ = sigma_.cwiseProduct(random_.NormalVector3());
  }

  const Eigen::Vector3d& value() const { return value_; }

  void Advance(double dt) {
    const double decay = memory_ > 0.0 ? std::exp(-dt / memory_) : 0.0;
    value_ = decay * value_ +
             std::sqrt(1.0 - decay * decay) * sigma_.cwiseProduct(random_.NormalVector3());
  }

 private:
  Eigen::Vector3d sigma_;
  double memory_;
  Random random_;
  Eigen::Vector3d value_;
};

// A Wiener process with three independent axes: variance grows by density^2 a second, from 0.
class Wiener {
 public:
  Wiener(const Eigen::Vector3d& density, std::uint64_t seed, std::string_view stream)
      : density_(density), random_(seed, stream) {}

  const Eigen::Vector3d& value() const { return value_; }

  void Advance(double dt) {
    value_ += std::sqrt(dt) * density_.cwiseProduct(random_.NormalVector3());
  }

 private:
  Eigen::Vector3d density_;
  Random random_;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero();
};

}  // namespace trueline::simulation
