#include "problems/rotor_batch/constants_information.h"

#include <glog/logging.h>

namespace trueline {
ConstantsInformation::ConstantsInformation(std::vector<int> free, const RotorConstants& scale)
    : free_(std::move(free)), scale_(scale) {
  const auto size = kNodeErrors + static_cast<Eigen::Index>(free_.size());
  information_ = Eigen::MatrixXd::Zero(size, size);
}

Eigen::MatrixXd ConstantsInformation::Scaled(const Eigen::MatrixXd& d_constants) const {
  Eigen::MatrixXd columns(d_constants.rows(), free_.size());
  for (std::size_t i = 0; i < free_.size(); ++i) {
    columns.col(static_cast<Eigen::Index>(i)) = d_constants.col(free_[i]) * scale_[free_[i]];
  }
  return columns;
}

void ConstantsInformation::AddAtNode(const Eigen::MatrixXd& d_node,
                                     const Eigen::MatrixXd& d_constants) {
  Eigen::MatrixXd J(d_node.rows(), information_.cols());
  J << d_node, Scaled(d_constants);
  information_.noalias() += J.transpose() * J;
}

void ConstantsInformation::StepToNext(const Eigen::MatrixXd& d_node, const Eigen::MatrixXd& d_next,
                                      const Eigen::MatrixXd& d_constants) {
  const auto constants = static_cast<Eigen::Index>(free_.size());
  Eigen::MatrixXd J(d_node.rows(), 2 * kNodeErrors + constants);  // node, next, constants
  J << d_node, d_next, Scaled(d_constants);
  Eigen::MatrixXd joint = J.transpose() * J;
  joint.topLeftCorner(kNodeErrors, kNodeErrors) +=
      information_.topLeftCorner(kNodeErrors, kNodeErrors);
  joint.topRightCorner(kNodeErrors, constants) +=
      information_.topRightCorner(kNodeErrors, constants);
  joint.bottomRightCorner(constants, constants) +=
      information_.bottomRightCorner(constants, constants);
  const Eigen::LLT<Eigen::MatrixXd> own(joint.topLeftCorner(kNodeErrors, kNodeErrors));
  CHECK(own.info() == Eigen::Success);
  log_determinant_ += 2.0 * own.matrixLLT().diagonal().array().log().sum();
  const Eigen::MatrixXd cross =
      own.matrixL().solve(joint.topRightCorner(kNodeErrors, kNodeErrors + constants));
  information_ = joint.bottomRightCorner(kNodeErrors + constants, kNodeErrors + constants);
  information_.triangularView<Eigen::StrictlyLower>() = information_.transpose();
  information_.noalias() -= cross.transpose() * cross;
}

Eigen::MatrixXd ConstantsInformation::Finish() {
  const auto constants = static_cast<Eigen::Index>(free_.size());
  const Eigen::LLT<Eigen::MatrixXd> own(information_.topLeftCorner(kNodeErrors, kNodeErrors));
  CHECK(own.info() == Eigen::Success);
  log_determinant_ += 2.0 * own.matrixLLT().diagonal().array().log().sum();
  const Eigen::MatrixXd cross =
      own.matrixL().solve(information_.topRightCorner(kNodeErrors, constants));
  Eigen::MatrixXd left =
      information_.bottomRightCorner(constants, constants) - cross.transpose() * cross;
  return 0.5 * (left + left.transpose());
}

}  // namespace trueline
