// Anderson acceleration (Anderson 1965): finds x with g(x) = x where the plain iteration x <- g(x)
// oscillates or converges slowly.
#pragma once

#include <Eigen/Dense>
#include <deque>

#include "problems/rotor/rotor_state.h"

namespace trueline {

class FixedPoint {
 public:
  // The next x to try. `scale`: the unit of each component of g(x) - x; zero for known components.
  RotorConstants Next(const RotorConstants& x, const RotorConstants& g,
                      const RotorConstants& scale) {
    constexpr std::size_t kMemory = 4;
    moves_.push_back(g - x);
    images_.push_back(g);
    if (moves_.size() > kMemory) moves_.pop_front(), images_.pop_front();
    const auto columns = static_cast<Eigen::Index>(moves_.size()) - 1;
    if (columns == 0) return g;
    const RotorConstants weight = (scale.array() > 0.0).select(scale.cwiseInverse(), 0.0);
    Eigen::MatrixXd d_move(g.size(), columns), d_image(g.size(), columns);
    for (Eigen::Index i = 0; i < columns; ++i) {
      d_move.col(i) = weight.cwiseProduct(moves_[i + 1] - moves_[i]);
      d_image.col(i) = images_[i + 1] - images_[i];
    }
    return g - d_image * d_move.colPivHouseholderQr().solve(weight.cwiseProduct(g - x));
  }

 private:
  std::deque<RotorConstants> moves_, images_;
};

}  // namespace trueline
