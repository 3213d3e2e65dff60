#include "problems/diagnosis/linearisation.h"

#include <cmath>

namespace trueline {

Eigen::VectorXd EffectColumns::Sizes(const EffectInfo& info, const Eigen::VectorXd& steps) const {
  Eigen::VectorXd sizes = steps;
  for (int i = 0; i < sizes.size(); ++i) {
    if (info.enters_squared) sizes[i] = std::copysign(std::sqrt(std::abs(sizes[i])), sizes[i]);
    sizes[i] *= unit[i];
  }
  return sizes;
}

Eigen::VectorXd EffectColumns::Steps(const EffectInfo& info, const Eigen::VectorXd& sizes) const {
  Eigen::VectorXd steps = sizes.cwiseQuotient(unit);
  if (info.enters_squared) steps = steps.cwiseProduct(steps.cwiseAbs());
  return steps;
}

std::vector<int> ColumnPlaces::Next(std::size_t count) {
  std::vector<int> next(count);
  for (int& column : next) column = placed++;
  return next;
}

std::vector<int> Linearisation::Modelled() const {
  std::vector<int> all = nuisances;
  for (const EffectColumns& f : found) all = Concatenated(std::move(all), f.columns);
  return all;
}

std::vector<int> Linearisation::Beside(std::size_t which) const {
  std::vector<int> beside = nuisances;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (k != which) beside = Concatenated(std::move(beside), found[k].columns);
  }
  return beside;
}

}  // namespace trueline
