// The marginalised past of a window as a prior on its first unknowns: sqrt_information * (x -
// mean), with x the given blocks in their order and units.
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <vector>

namespace trueline {

class WindowPriorResidual : public ceres::CostFunction {
 public:
  // sizes: of the blocks; they sum to the size of `mean`. sqrt_information is square.
  WindowPriorResidual(const Eigen::VectorXd& mean, const Eigen::MatrixXd& sqrt_information,
                      const std::vector<int>& sizes)
      : mean_(mean), sqrt_information_(sqrt_information) {
    set_num_residuals(static_cast<int>(mean.size()));
    mutable_parameter_block_sizes()->assign(sizes.begin(), sizes.end());
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::VectorXd x(mean_.size());
    int first = 0;
    for (std::size_t i = 0; i < parameter_block_sizes().size(); ++i) {
      const int size = parameter_block_sizes()[i];
      x.segment(first, size) = Eigen::Map<const Eigen::VectorXd>(parameters[i], size);
      if (jacobians != nullptr && jacobians[i] != nullptr) {
        using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::Map<RowMajor>(jacobians[i], mean_.size(), size) =
            sqrt_information_.middleCols(first, size);
      }
      first += size;
    }
    Eigen::Map<Eigen::VectorXd>(residuals, mean_.size()) = sqrt_information_ * (x - mean_);
    return true;
  }

 private:
  Eigen::VectorXd mean_;
  Eigen::MatrixXd sqrt_information_;
};

}  // namespace trueline
