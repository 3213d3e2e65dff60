// Evidence and covariance of whole flights, by the Gauss-Newton Hessian at the optimum.
#include <Eigen/SparseCholesky>

#include "problems/common/ceres_problem.h"
#include "problems/smoother/flight_problem.h"

namespace trueline {

// Blocks in the order of time, those that couple with all others last.
std::vector<double*> FlightProblem::OrderedBlocks() {
  std::vector<double*> blocks;
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    blocks.push_back(x_.theta[k].data());
    for (std::size_t s = sections_[k].first_segment; s < EndOf(k); ++s) {
      blocks.push_back(x_.drift[s].data());
      blocks.push_back(x_.states[s].data());
      if (gusts_.Any()) blocks.push_back(gusts_.block(s));
    }
    if (const auto it = offsets_.find(k); it != offsets_.end()) {
      blocks.push_back(it->second.data());
    }
  }
  if (!options_.detector.Any()) return blocks;
  blocks.push_back(mount_.data());
  for (auto& [id, offset] : gates_) blocks.push_back(offset.data());
  return blocks;
}

Eigen::SparseMatrix<double> FlightProblem::Hessian() {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = OrderedBlocks();
  ceres::CRSMatrix crs;
  problem_.Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::SparseMatrix<double> J = ToEigen(crs);
  return J.transpose() * J;
}

double FlightProblem::LogEvidence() {
  double cost = 0.0;
  problem_.Evaluate(ceres::Problem::EvaluateOptions(), &cost, nullptr, nullptr, nullptr);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(Hessian());
  const double log_det = ldlt.vectorD().cwiseMax(1e-300).array().log().sum();
  return log_weights_ - cost - 0.5 * log_det;
}

namespace {

constexpr std::size_t kDoubtful = 200;  // segments at which the velocity's covariance is sampled

}  // namespace

FlightProblem::Means FlightProblem::MeanUnknowns() {
  const int extra = options_.detector.Any() ? kMountSize + kGateSize * int(gates_.size()) : 0;
  const int asked = kThetaSize + extra;
  const Eigen::SparseMatrix<double> H = Hessian();
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(H.rows(), asked);
  Means means;
  means.value = Eigen::VectorXd::Zero(asked);
  std::vector<std::pair<std::size_t, int>> doubtful;  // segment, column of its velocity
  const std::size_t step = 1 + segments_.size() / kDoubtful;
  double total = 0.0;
  for (const auto& segment : segments_) total += SecondsBetween(segment->start(), segment->end());
  int at = 0;
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    const int theta_at = at;
    at += kThetaSize;
    for (std::size_t s = sections_[k].first_segment; s < EndOf(k); ++s) {
      const double share = SecondsBetween(segments_[s]->start(), segments_[s]->end()) / total;
      means.value.head<kThetaSize>() += share * x_.theta[k];
      means.value.segment<kDriftSize>(kAhrsInTheta) += share * x_.drift[s];
      G.block<kThetaSize, kThetaSize>(theta_at, 0).diagonal().array() += share;
      G.block<kDriftSize, kDriftSize>(at, kAhrsInTheta).diagonal().setConstant(share);
      if (segments_[s]->force_count() > 0 && s % step == 0) {
        doubtful.emplace_back(s, at + kDriftSize + 3);
      }
      at += kDriftSize + kStateSize + (gusts_.Any() ? kGustSize : 0);
    }
    if (offsets_.count(k) > 0) at += 6;
  }
  G.bottomRightCorner(extra, extra).setIdentity();
  if (extra > 0) means.value.segment<kMountSize>(kThetaSize) = mount_;
  int gate_at = kThetaSize + kMountSize;
  for (const auto& [id, offset] : gates_) {
    means.value.segment<kGateSize>(gate_at) = offset;
    gate_at += kGateSize;
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> ldlt(H);
  means.cov = G.transpose() * ldlt.solve(G);
  for (const FlightShare& share : flights_) {
    means.force_sigma = std::max(means.force_sigma, share.flight->forces.sigma);
  }
  for (const auto& [s, velocity_at] : doubtful) {
    const Eigen::Matrix<double, 3, 2> axes = segments_[s]->BodyAxesAtStart();
    Eigen::MatrixXd g = Eigen::MatrixXd::Zero(H.rows(), 2);
    g.block<3, 2>(velocity_at, 0) = axes;
    const Eigen::Vector2d variance = g.cwiseProduct(ldlt.solve(g)).colwise().sum();
    means.doubt.Add(axes.transpose() * x_.states[s].tail<3>(), variance,
                    static_cast<int>(step) * segments_[s]->force_count());
  }
  return means;
}

}  // namespace trueline
