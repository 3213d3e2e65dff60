// Segments of flight as one least-squares problem: the unknowns of a window and of whole flights,
// their process and measurements, and the integration that the residuals share.
#pragma once

#include <ceres/ceres.h>

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "cost_functions/chain_node.h"
#include "cost_functions/continuity_residual.h"
#include "cost_functions/fix_residual.h"
#include "problems/chain/section_chain.h"
#include "problems/chain/trust_region.h"
#include "problems/vgd/drag_errors.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/segment.h"

namespace trueline {

class SegmentChain : private ceres::EvaluationCallback {
 public:
  using Normal = SectionChain<kNodeSize, kThetaSize>;
  using Columns = Normal::Columns;
  static constexpr int kMostBorder = kOffsetSize;
  struct Unknowns {
    std::deque<ThetaVector> theta;  // terms point into all three
    std::deque<NodeVector> nodes;   // by segment
    std::deque<Eigen::Matrix<double, kMostBorder, 1>> border;

    bool operator==(const Unknowns&) const = default;
  };

  // Uses the options' priors (scaling), process, loss and whitening.
  explicit SegmentChain(const VgdOptions& options);
  SegmentChain(const SegmentChain&) = delete;
  SegmentChain& operator=(const SegmentChain&) = delete;

  // Building: all segments and border unknowns first, then residuals.
  //
  // A block of shared parameters (in units of their prior sigmas, zero at the start) for the
  // segments that are added from now on: a section.
  void AddTheta();
  // `linked`: the segment begins where the last one ends.
  void AddSegment(std::unique_ptr<Segment> segment, bool linked);
  // Unknowns beside theta and nodes, at most kMostBorder in a block, with a zero-mean prior
  // (residual weight * x); segment s is the first that they affect. Local ones belong to its
  // section alone; add these first, all of one size.
  double* AddBorder(std::size_t s, const Eigen::VectorXd& weight, bool local);

  // A residual of a reading of segment s and of border unknowns.
  void AddReading(std::size_t s, ceres::CostFunction* cost, ceres::LossFunction* loss,
                  const std::vector<double*>& border = {});
  // A residual of the starts of segments s and s + 1, which are linked, and of a border unknown.
  void AddStarts(std::size_t s, ceres::CostFunction* cost, ceres::LossFunction* loss,
                 const double* border);
  // A force sample against drag; sigma in m/s^2. Huber's loss.
  void AddForce(std::size_t s, const ForceSample& force, double sigma);
  // The process from a segment to the next, which is linked to it.
  void AddStep(std::size_t s, double gravity);
  // The step of theta from a section to the next: theta, next.
  void AddThetaStep(std::size_t section, ceres::CostFunction* cost);
  // Priors of drift and gust on a segment that is not linked to the one before.
  void AddStart(std::size_t s);
  // A zero-mean prior on a segment's theta: residual weight * x; a zero weight leaves a component
  // free.
  void AddThetaPrior(std::size_t s, const ThetaVector& weight);
  // A prior on a segment's theta and node: drift and state, then the gust if there is one.
  void AddNodePrior(std::size_t s, ceres::CostFunction* cost);
  // The bounds of the options' priors, on every theta.
  void SetBounds() { bounded_ = true; }
  // Where the options have no process: drift stays zero.
  void HoldDrift() { drift_held_ = true; }
  // Holds theta at its value, or frees it.
  void HoldTheta(bool hold);

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
  const NodeVector& node(std::size_t s) const { return x_.nodes[s]; }
  auto state(std::size_t s) const { return x_.nodes[s].segment<kStateSize>(kStateAt); }
  // Sets position and velocity; drift and gust return to zero.
  void SetState(std::size_t s, const Eigen::Vector3d& p, const Eigen::Vector3d& v);
  const Unknowns& unknowns() const { return x_; }
  // `x`: of a chain with the same segments and border.
  void StartFrom(const Unknowns& x) { x_ = x; }

  void AddLogWeights(double sum) { log_weights_ += sum; }

  // Integrates with the current unknowns; readings then hold the fitted trajectory.
  void Refresh(bool derivatives);
  // One segment alone, without derivatives.
  void Integrate(std::size_t s);

  // Minimises the cost; in the summary only what the project reads is set.
  ceres::Solver::Summary Solve(const TrustRegionOptions& options);
  ceres::Solver::Summary Solve(const ceres::Solver::Options& options);
  // The same cost as a problem of Ceres'. It shares the unknowns.
  ceres::Problem& problem();

  // Log marginal likelihood by Laplace's approximation at the current unknowns, up to a constant.
  double LogEvidence();
  // Covariances by the Gauss-Newton Hessian, robust losses included. Of `count` linear functions of
  // the unknowns: add(s, G) adds their derivatives by the unknowns of segment s, for all of them,
  // to the rows of G from Normal::kNodeAt, kSharedAt and kBorderAt.
  using AddSlopes = std::function<void(std::size_t s, Columns* G)>;
  Eigen::MatrixXd Covariance(int count, const AddSlopes& add);
  // Of (node, theta, border): visit(s, F) for all segments from the last one on.
  using VisitCovariance = std::function<void(std::size_t s, const Eigen::MatrixXd& F)>;
  void VisitCovariances(const VisitCovariance& visit);
  // Adds a segment's velocity and its uncertainty (F as above), as if `segments` were like it.
  void AddDragErrors(std::size_t s, const Eigen::MatrixXd& F, int segments,
                     DragErrors* drag_errors) const;
  // Whitened rows of all residuals of segment s, in Normal's columns.
  Columns Rows(std::size_t s);

  const ParameterScaling& scaling() const { return scaling_; }

 private:
  // A residual block: its cost and loss, its parameter blocks and their columns in a row.
  struct Term {
    struct Block {
      double* data;
      int size, column;
    };
    std::unique_ptr<ceres::CostFunction> cost;
    std::unique_ptr<ceres::LossFunction> loss;  // null: squares
    std::array<Block, 6> blocks;
    int count = 0;  // of blocks

    void Add(const Block& block) { blocks[count++] = block; }
  };
  struct Border {
    Term::Block block;
    std::size_t section;  // of a local one
    bool local;
  };
  class Minimiser;

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;
  void Integrate(std::size_t s, bool derivatives);
  Gusts GustsOf(std::size_t s) const;
  bool IsLinked(std::size_t s) const { return s + 1 < linked_.size() && linked_[s + 1]; }
  // One after the section's last segment.
  std::size_t EndOf(std::size_t section) const {
    return section + 1 < begin_of_.size() ? begin_of_[section + 1] : size();
  }
  // Blocks of normal_, in which a section follows its last segment.
  int BlockOf(std::size_t s) const { return static_cast<int>(s + theta_of_[s]); }
  int BlockOfSection(std::size_t k) const { return static_cast<int>(EndOf(k) + k); }

  Term::Block BorderBlock(const double* data) const;
  Term& NewTerm(std::vector<Term>* terms, ceres::CostFunction* cost, ceres::LossFunction* loss);
  Term::Block ThetaBlock(std::size_t s) {
    return {x_.theta[theta_of_[s]].data(), kThetaSize, Normal::kSharedAt};
  }
  Term::Block PathBlock(std::size_t s, int column) { return {x_.nodes[s].data(), kGustAt, column}; }
  Term::Block GustBlock(std::size_t s, int column) {
    return {x_.nodes[s].data() + kGustAt, kGustSize, column + kGustAt};
  }
  // A term's cost; infinite where it can't be evaluated. Writes its whitened rows if `rows` is not
  // null.
  double Evaluate(const Term& term, double* rows) const;
  // Of a parameter, in units of its prior sigma.
  std::pair<double, double> ScaledBounds(int parameter) const;
  double Cost() const;
  // Writes the terms' rows one after the other into rows_, adds their cost and returns their
  // number.
  int FillRows(std::span<const Term> terms, double* cost);
  // Assembles and eliminates all rows; returns the cost.
  double Linearise(double radius);
  // The same without damping, unless it was done for these unknowns; returns the cost.
  double Factorise();
  Normal& normal();

  VgdOptions options_;
  ParameterScaling scaling_;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<std::size_t> theta_of_;     // by segment: its section
  std::vector<std::size_t> begin_of_;     // by section: its first segment
  std::vector<bool> linked_;              // by segment: to the one before
  std::vector<std::vector<Term>> terms_;  // by segment, its step to the next one included
  std::vector<Term> theta_steps_;         // by section, to the next
  std::vector<Border> border_;            // as x_.border
  int border_size_ = 0, local_size_ = 0;
  bool bounded_ = false, drift_held_ = false, theta_held_ = false;
  Unknowns x_;
  Unknowns values_at_, derivatives_at_;  // of the readings
  bool has_forces_ = false;
  double log_weights_ = 0.0;  // sum of the log determinants of what whitens
  std::optional<Normal> normal_;
  std::vector<double> rows_;
  std::vector<int> segment_of_;       // by block of normal_; -1: a section
  std::optional<double> factorised_;  // cost where normal_ was assembled without damping
  Unknowns factorised_at_;
  std::unique_ptr<ceres::Problem> problem_;
};

}  // namespace trueline
