#include "problems/diagnosis/chain_system.h"

namespace trueline {
namespace {

BorderedChain<kNodeSize> MakeChain(const LinearFlight& linear, const NoiseStrengths& noise) {
  std::vector<SegmentRows> rows;
  for (int s = 0; s < static_cast<int>(linear.flight.plan().segments.size()); ++s) {
    rows.push_back(FixStack(linear, s, noise.fix_scale));
    rows.back().Add(ForceStack(linear, s, noise.force_sigma));
    rows.back().Add(LinkStack(linear, s, noise));
    rows.back().Add(StartStack(linear, s, noise));
  }
  return BorderedChain<kNodeSize>(std::move(rows));
}

}  // namespace

ReducedSystem::Prior BorderPrior(const LinearFlight& linear) {
  const int columns = linear.columns.count();
  ReducedSystem::Prior prior{Eigen::VectorXd::Ones(kThetaSize + columns),
                             Eigen::VectorXd(kThetaSize + columns)};
  prior.precision.tail(columns) = linear.columns.precision;
  prior.error << linear.x.theta, linear.columns.value;
  return prior;
}

ChainSystem::ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise)
    : flight_(linear.flight),
      prior_(BorderPrior(linear)),
      chain_(MakeChain(linear, noise)),
      reduced_(chain_.Reduced(prior_)) {}

ReducedSystem ChainSystem::ByCluster() const {
  return chain_.Reduced(prior_, flight_.plan().clusters);
}

Eigen::VectorXd ChainSystem::Whitened(const Eigen::VectorXd& e) const {
  Eigen::VectorXd whitened = Eigen::VectorXd::Zero(flight_.measurement_rows());
  chain_.VisitRowsAt(e, [&](std::size_t, const SegmentRows& rows, const Eigen::MatrixXd& at) {
    for (int i = 0; i < rows.count(); ++i) {
      if (rows.id[i] >= 0) whitened[rows.id[i]] = at(i, 0);
    }
  });
  return whitened;
}

}  // namespace trueline
