#include "problems/simulation/slow_moments.h"

#include <cmath>
#include <numbers>

namespace trueline::simulation {
namespace {

constexpr double kShortest = 0.3;  // s
constexpr double kEvery = 0.5;     // s, mean time between the starts of eddies

}  // namespace

// The mean square of a sum of eddies is their rate times the mean of peak^2 (3 / 8) length.
Eigen::Vector3d SlowMoments::At(double t) {
  if (rms_ == 0.0) return Eigen::Vector3d::Zero();
  const double mean_square = 3.0 / 8.0 * 0.5 * (kShortest + kLongest) / kEvery;
  while (next_ <= t) {
    const double length = random_.Uniform(kShortest, kLongest);
    eddies_.push_back({next_, length, rms_ / std::sqrt(mean_square) * random_.NormalVector3()});
    next_ -= kEvery * std::log(random_.Uniform(1e-12, 1.0));
  }
  std::erase_if(eddies_, [t](const Eddy& eddy) { return t > eddy.start + eddy.length; });
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eddy& eddy : eddies_) {
    const double phase = 2.0 * std::numbers::pi * (t - eddy.start) / eddy.length;
    sum += 0.5 * (1.0 - std::cos(phase)) * eddy.peak;
  }
  return sum;
}

}  // namespace trueline::simulation
