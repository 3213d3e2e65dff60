// Covariance of whole flights, by the Gauss-Newton Hessian at the optimum.
#include "problems/smoother/flight_problem.h"

namespace trueline {
namespace {

constexpr std::size_t kSampled = 200;  // segments at which the velocity's covariance is computed

}  // namespace

FlightProblem::Means FlightProblem::MeanUnknowns() {
  using Normal = SegmentChain::Normal;
  Means means;
  const auto seconds = [this](std::size_t s) {
    return SecondsBetween(chain_.segment(s).start(), chain_.segment(s).end());
  };
  double total = 0.0;
  for (std::size_t s = 0; s < chain_.size(); ++s) total += seconds(s);
  std::vector<double> shares;
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    for (std::size_t s = sections_[k].first_segment; s < sections_[k].end_segment; ++s) {
      const double share = seconds(s) / total;
      shares.push_back(share);
      means.value += share * chain_.theta(k);
      means.value.segment<kDriftSize>(kAhrsInTheta) += share * chain_.node(s).head<kDriftSize>();
    }
  }
  means.cov = chain_.Covariance(kThetaSize, [&](std::size_t s, SegmentChain::Columns* G) {
    G->block<kThetaSize, kThetaSize>(Normal::kSharedAt, 0).diagonal().array() += shares[s];
    G->block<kDriftSize, kDriftSize>(Normal::kNodeAt, kAhrsInTheta).diagonal().array() += shares[s];
  });
  for (const FlightShare& share : flights_) {
    means.force_sigma = std::max(means.force_sigma, ForceSigma(*share.flight));
  }
  const std::size_t step = 1 + chain_.size() / kSampled;
  chain_.VisitCovariances([&](std::size_t s, const Eigen::MatrixXd& F) {
    if (s % step != 0 || chain_.segment(s).force_count() == 0) return;
    chain_.AddDragErrors(s, F, static_cast<int>(step), &means.drag_errors);
  });
  return means;
}

}  // namespace trueline
