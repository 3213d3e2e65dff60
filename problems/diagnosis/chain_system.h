// The linearised flight as a chain of segments with a border: theta, effect parameters, the
// residual.
#pragma once

#include "problems/diagnosis/chain_stacks.h"

namespace trueline {

// Priors of theta (in its own sigmas) and of the columns.
ReducedSystem::Prior BorderPrior(const LinearFlight& linear);

class ChainSystem {
 public:
  // All that `linear` refers to must outlive this object.
  ChainSystem(const LinearFlight& linear, const NoiseStrengths& noise);

  const BorderedChain<kNodeSize>& chain() const { return chain_; }
  int border() const { return chain_.border(); }
  // As one cluster; and by the clusters of the flight's plan.
  const ReducedSystem& reduced() const { return reduced_; }
  ReducedSystem ByCluster() const;

  // Whitened residuals of the measurement rows for border values `e` (ReducedSystem::Fitted).
  Eigen::VectorXd Whitened(const Eigen::VectorXd& e) const;

 private:
  const BaseFlight& flight_;
  ReducedSystem::Prior prior_;
  BorderedChain<kNodeSize> chain_;
  ReducedSystem reduced_;
};

}  // namespace trueline
