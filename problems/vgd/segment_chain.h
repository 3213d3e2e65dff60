// Segments of flight as one least-squares problem: the unknowns of a window and of whole flights,
// their process and measurements, and the integration that the residuals share.
#pragma once

#include <ceres/ceres.h>

#include <deque>
#include <memory>
#include <vector>

#include "cost_functions/chain_node.h"
#include "cost_functions/continuity_residual.h"
#include "cost_functions/fix_residual.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/segment.h"

namespace trueline {

class SegmentChain : private ceres::EvaluationCallback {
 public:
  // Uses the options' priors (scaling), process, loss and whitening.
  explicit SegmentChain(const VgdOptions& options);
  SegmentChain(const SegmentChain&) = delete;
  SegmentChain& operator=(const SegmentChain&) = delete;

  // Building: all segments first, then residuals.
  //
  // A block of shared parameters (in units of their prior sigmas, zero at the start) for the
  // segments that are added from now on.
  void AddTheta();
  // `linked`: the segment begins where the last one ends.
  void AddSegment(std::unique_ptr<Segment> segment, bool linked);

  // A residual of a reading of segment s and of blocks of its own.
  ceres::ResidualBlockId AddReading(std::size_t s, ceres::CostFunction* cost,
                                    ceres::LossFunction* loss,
                                    const std::vector<double*>& own = {});
  // A force sample against drag; sigma in m/s^2. Huber's loss.
  void AddForce(std::size_t s, const ForceSample& force, double sigma);
  // The process from a segment to the next, which is linked to it.
  void AddStep(std::size_t s, double gravity);
  // Priors of drift and gust on a segment that is not linked to the one before.
  std::vector<ceres::ResidualBlockId> AddStart(std::size_t s);
  // A zero-mean prior on a block: residual weight * x; a zero weight leaves a component free.
  ceres::ResidualBlockId AddPrior(double* block, const Eigen::VectorXd& weight);
  // The bounds of the options' priors, on every theta.
  void SetBounds();
  // Where the options have no process: drift stays zero.
  void HoldDrift(std::size_t s);

  std::size_t size() const { return segments_.size(); }
  const std::vector<std::unique_ptr<Segment>>& segments() const { return segments_; }
  const Segment& segment(std::size_t s) const { return *segments_[s]; }
  Segment& segment(std::size_t s) { return *segments_[s]; }
  // Segment at a time within [first, end); the first one with the latest start at or before t.
  std::size_t SegmentAt(TimeNs t, std::size_t first, std::size_t end) const;
  // Slopes of readings by the gusts that act in the segment.
  GustSlope<6> StateGusts(std::size_t s, TimeNs t) const;
  GustSlope<2> ForceGusts(std::size_t s, TimeNs t) const;
  bool HasForces() const { return has_forces_; }
  bool HasGusts() const { return options_.UsesGusts(); }

  ThetaVector& theta(std::size_t k = 0) { return x_.theta[k]; }
  const ThetaVector& theta(std::size_t k = 0) const { return x_.theta[k]; }
  NodeVector& node(std::size_t s) { return x_.nodes[s]; }
  const NodeVector& node(std::size_t s) const { return x_.nodes[s]; }
  auto state(std::size_t s) const { return x_.nodes[s].segment<kStateSize>(kStateAt); }
  // Sets position and velocity; drift and gust return to zero.
  void SetState(std::size_t s, const Eigen::Vector3d& p, const Eigen::Vector3d& v);
  // The parameter blocks of a segment's own unknowns.
  std::vector<double*> NodeBlocks(std::size_t s);
  // Takes all unknowns of a chain with the same segments.
  void StartFrom(const SegmentChain& other) { x_ = other.x_; }

  // Residuals that involve segment s, its step to the next one included.
  const std::vector<ceres::ResidualBlockId>& residuals(std::size_t s) const {
    return residuals_[s];
  }
  // Sum of the log determinants of what whitens processes and priors.
  double log_weights() const { return log_weights_; }
  void AddLogWeights(double sum) { log_weights_ += sum; }

  // Integrates with the current unknowns; readings then hold the fitted trajectory.
  void Refresh(bool derivatives);
  // One segment alone, without derivatives.
  void Integrate(std::size_t s);
  ceres::Solver::Summary Solve(const ceres::Solver::Options& options);

  const ParameterScaling& scaling() const { return scaling_; }
  ceres::Problem& problem() { return problem_; }

 private:
  struct Unknowns {
    std::deque<ThetaVector> theta;  // blocks point into both
    std::deque<NodeVector> nodes;   // by segment

    bool operator==(const Unknowns&) const = default;
  };

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;
  void Integrate(std::size_t s, bool derivatives);
  Gusts GustsOf(std::size_t s) const;
  bool IsLinked(std::size_t s) const { return s + 1 < linked_.size() && linked_[s + 1]; }

  VgdOptions options_;
  ParameterScaling scaling_;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<std::size_t> theta_of_;  // by segment
  std::vector<bool> linked_;           // by segment: to the one before
  std::vector<std::vector<ceres::ResidualBlockId>> residuals_;
  Unknowns x_;
  Unknowns integrated_;           // the readings' linearisation point
  bool has_derivatives_ = false;  // whether they hold derivatives there
  bool has_forces_ = false;
  double log_weights_ = 0.0;
  ceres::Problem problem_;
};

}  // namespace trueline
