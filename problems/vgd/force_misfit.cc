#include "problems/vgd/force_misfit.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

constexpr double kLongest = 1.0;  // s: the fit's gusts and biases explain what lasts longer

// c_0 + 2 sum of c_k up to `lags`, of both axes together. Bartlett's weights keep it positive.
double VarianceAtZero(const std::vector<Eigen::Vector2d>& misfits, std::size_t lags) {
  double sum = 0.0;
  for (std::size_t k = 0; k <= lags; ++k) {
    double products = 0.0;
    for (std::size_t i = k; i < misfits.size(); ++i) products += misfits[i].dot(misfits[i - k]);
    const double taper = 1.0 - static_cast<double>(k) / static_cast<double>(lags + 1);
    sum += (k == 0 ? 1.0 : 2.0 * taper) * products;
  }
  return sum / (2.0 * static_cast<double>(misfits.size()));
}

}  // namespace

void ForceMisfit::Add(const std::vector<Eigen::Vector2d>& misfits, double apart) {
  const auto lags = static_cast<std::size_t>(std::lround(kLongest / apart));
  if (misfits.size() < 3 * lags) return;
  const auto count = static_cast<double>(misfits.size());
  sum_ += count * VarianceAtZero(misfits, lags);
  weight_ += count;
}

double ForceMisfit::Scale(double sigma) const {
  if (weight_ == 0.0) return 1.0;
  return std::max(1.0, std::sqrt(sum_ / weight_) / sigma);
}

}  // namespace trueline
