// Random numbers with fixed seeds. Independent streams are derived from one seed by name, so that
// switching one effect on does not change the draws of another. Noise processes in discrete time.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>
#include <string_view>

namespace trueline {

class Random {
 public:
  explicit Random(std::uint64_t seed, std::string_view stream = "") {
    std::uint64_t hash = 0xcbf29ce484222325ULL ^ seed;  // FNV-1a over the stream's name
    for (const char c : stream) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
    std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                           static_cast<std::uint32_t>(hash),
                           static_cast<std::uint32_t>(hash >> 32)};
    engine_.seed(sequence);
  }

  double Normal() { return normal_(engine_); }
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int UniformInt(int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(engine_);
  }
  bool Bernoulli(double probability) { return Uniform(0.0, 1.0) < probability; }
  Eigen::Vector3d NormalVector3() { return {Normal(), Normal(), Normal()}; }
  // Student's t with `dof` degrees of freedom (heavy tails for small dof).
  double StudentT(double dof) { return std::student_t_distribution<double>(dof)(engine_); }

  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

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

}  // namespace trueline
