#include "problems/diagnosis/whiteness.h"

#include <cmath>

namespace trueline {

double WhitenessOf(const std::vector<TimedResidual>& residuals, double apart) {
  double products = 0.0, squares = 0.0;
  for (std::size_t i = 1; i < residuals.size(); ++i) {
    if (residuals[i].t - residuals[i - 1].t >= apart) continue;
    const Eigen::VectorXd product = residuals[i - 1].value.cwiseProduct(residuals[i].value);
    products += product.sum();
    squares += product.squaredNorm();  // its variance, also under heavy tails
  }
  return squares > 0.0 ? std::erfc(std::abs(products) / std::sqrt(2.0 * squares)) : 1.0;
}

std::vector<TimedResidual> SumsOfBlocks(const std::vector<TimedResidual>& residuals,
                                        double length) {
  std::vector<TimedResidual> blocks;
  for (const TimedResidual& r : residuals) {
    if (blocks.empty() || r.t >= blocks.back().t + length) {
      blocks.push_back(r);
    } else {
      blocks.back().value += r.value;
    }
  }
  return blocks;
}

}  // namespace trueline
