// Evidence and covariance of whole flights, by the Gauss-Newton Hessian at the optimum.
#include "problems/chain/gauss_newton.h"
#include "problems/smoother/flight_problem.h"

namespace trueline {
namespace {

constexpr std::size_t kSampled = 200;  // segments at which the velocity's covariance is computed

}  // namespace

std::vector<double*> FlightProblem::Blocks() {
  std::vector<double*> blocks;
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    blocks.push_back(chain_.theta(k).data());
    for (std::size_t s = sections_[k].first_segment; s < sections_[k].end_segment; ++s) {
      for (double* block : chain_.NodeBlocks(s)) blocks.push_back(block);
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

double FlightProblem::LogEvidence() {
  return LaplaceEvidence(&chain_.problem(), Blocks(), chain_.log_weights());
}

FlightProblem::Means FlightProblem::MeanUnknowns() {
  const int extra = options_.detector.Any() ? kMountSize + kGateSize * int(gates_.size()) : 0;
  const int asked = kThetaSize + extra;
  const GaussNewton normal(&chain_.problem(), Blocks());
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(normal.size(), asked);
  Means means;
  means.value = Eigen::VectorXd::Zero(asked);
  const auto seconds = [this](std::size_t s) {
    return SecondsBetween(chain_.segment(s).start(), chain_.segment(s).end());
  };
  double total = 0.0;
  for (std::size_t s = 0; s < chain_.size(); ++s) total += seconds(s);
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    const Eigen::Index theta_at = normal.At(chain_.theta(k).data());
    for (std::size_t s = sections_[k].first_segment; s < sections_[k].end_segment; ++s) {
      const double share = seconds(s) / total;
      means.value.head<kThetaSize>() += share * chain_.theta(k);
      means.value.segment<kDriftSize>(kAhrsInTheta) += share * chain_.node(s).head<kDriftSize>();
      G.block<kThetaSize, kThetaSize>(theta_at, 0).diagonal().array() += share;
      G.block<kDriftSize, kDriftSize>(normal.At(chain_.node(s).data()), kAhrsInTheta)
          .diagonal()
          .setConstant(share);
    }
  }
  G.bottomRightCorner(extra, extra).setIdentity();
  if (extra > 0) means.value.segment<kMountSize>(kThetaSize) = mount_;
  for (int at = kThetaSize + kMountSize; const auto& [id, offset] : gates_) {
    means.value.segment<kGateSize>(at) = offset;
    at += kGateSize;
  }
  means.cov = G.transpose() * normal.Solve(G);
  for (const FlightShare& share : flights_) {
    means.force_sigma = std::max(means.force_sigma, ForceSigma(*share.flight));
  }
  const std::size_t step = 1 + chain_.size() / kSampled;
  for (std::size_t s = 0; s < chain_.size(); s += step) {
    const Segment& segment = chain_.segment(s);
    if (segment.force_count() == 0) continue;
    const Eigen::Matrix<double, 3, 2> axes = segment.BodyAxesAtStart();
    Eigen::MatrixXd g = Eigen::MatrixXd::Zero(normal.size(), 2);
    g.block<3, 2>(normal.At(chain_.node(s).data()) + kStateAt + 3, 0) = axes;
    const Eigen::Vector2d variance = g.cwiseProduct(normal.Solve(g)).colwise().sum();
    means.doubt.Add(axes.transpose() * chain_.state(s).tail<3>(), variance,
                    static_cast<int>(step) * segment.force_count());
  }
  return means;
}

}  // namespace trueline
