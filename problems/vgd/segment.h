// One segment of a window or a whole flight: its chain of blocks, the nodes at which residuals read
// it, and the step to the next one.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "cost_functions/chain_node.h"
#include "cost_functions/continuity_residual.h"
#include "cost_functions/models/process_noise.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/motion_chain.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Means and sigmas of the scaling: parameter = mean + sigma * scaled unknown.
struct ParameterScaling {
  Eigen::Matrix<double, kThetaSize, 1> mean, sigma;

  explicit ParameterScaling(const VgdOptions& options);

  // rad for each unit of a drift block.
  Eigen::Vector3d DriftUnit() const { return sigma.segment<kDriftSize>(kAhrsInTheta); }
};

class Segment {
 public:
  // Both times ascending and unique in [start, end]; the last of `times` is `end`. `scaling` must
  // outlive the segment.
  Segment(const DriveTrack& track, TimeNs start, const std::vector<TimeNs>& times,
          const std::vector<TimeNs>& force_times, const ParameterScaling& scaling,
          double max_block);

  // Integrates from the given scaled parameters (sizes kThetaSize, kDriftSize, kStateSize) and
  // fills all nodes, with derivatives if `derivatives`.
  void Evaluate(const double* theta, const double* drift, const double* state, bool derivatives);
  // Adds the gusts' effect to the values of all nodes; call it once after Evaluate.
  void AddGusts(const GustPair& gusts);

  // From now on nodes are extrapolated linearly near the last linearisation point instead of
  // integrated (within 0.01 mm over a second). For problems that are solved repeatedly.
  void FollowDerivatives() { follows_ = true; }

  // Force beyond linear drag; replaces the track's.
  void SetForceEffects(const ForceEffects& effects) { effects_ = effects; }

  const StateNode* StateAt(TimeNs t) const { return &states_[IndexOf(t)]; }
  const ForceNode* ForceAt(TimeNs t) const;
  // Derivatives of these nodes to the gusts at the segment's ends.
  const StateByGusts::Slope& StateGustsAt(TimeNs t) const { return by_gusts_[IndexOf(t)]; }
  Eigen::Matrix<double, 2, 4> ForceGustsAt(TimeNs t) const;
  int force_count() const { return static_cast<int>(forces_.size()); }
  // Body x and y axes in E at the first force sample (zero if there is none), up to the AHRS's
  // error.
  Eigen::Matrix<double, 3, 2> BodyAxesAtStart() const;
  const StateNode* end_node() const { return &states_.back(); }
  // z of the IMU in E halfway, up to the AHRS's error.
  const Eigen::Vector3d& thrust_axis() const { return thrust_axis_; }
  TimeNs start() const { return chain_.start(); }
  TimeNs end() const { return chain_.times().back(); }
  const std::vector<TimeNs>& times() const { return chain_.times(); }

 private:
  using Vector = Eigen::Matrix<double, kThetaSize, 1>;

  // Inputs of the integration: theta with drift and the attitude filter's errors, whose own entries
  // are zero (scaled), and state.
  struct Inputs {
    Vector theta;
    Eigen::Matrix<double, kStateSize, 1> state;
  };
  bool IsNear(const Inputs& at) const;
  // T: double, or MotionJet to store derivatives as well.
  template <typename T>
  void Integrate(const Inputs& at);
  void Linearise(const Inputs& at);
  void Extrapolate(const Inputs& to);

  struct Force {
    std::size_t time_index;
    double t;  // s from the log's start
    Drive drive;
    double thrust;  // m/s^2, a short mean
    ForceNode node;
  };
  // Stores what x holds: the values, and the derivatives if x has them.
  template <typename T, int kSize>
  void Store(const Eigen::Matrix<T, kSize, 1>& x, SegmentNode<kSize>* node) const;
  std::size_t IndexOf(TimeNs t) const;
  const Force& FindForce(TimeNs t) const;
  Eigen::Matrix<double, 2, 4> ForceByGusts(const Force& force) const;

  MotionChain chain_;
  const ParameterScaling* scaling_;
  // Of the scaled Phi_E_Ep by the scaled errors of the attitude filter, as constant as a drift is.
  AttitudeErrors::Slopes attitude_errors_;
  Eigen::Vector3d thrust_axis_;
  double gravity_;
  ThrustAxis axis_;
  ForceEffects effects_;
  std::vector<StateNode> states_;              // by time
  std::vector<StateByGusts::Slope> by_gusts_;  // of (p_E, v_E), by time
  std::vector<Force> forces_;                  // ascending in time
  bool follows_ = false;
  // The nodes' linearisation point, and their values there (without gusts).
  std::optional<Inputs> linearised_at_;
  std::vector<Eigen::Matrix<double, kStateSize, 1>> states_there_;
  std::vector<Eigen::Vector2d> forces_there_;
};

// The segment [from, to] of a window. A measurement at a knot belongs to the segment that begins
// there, so a window cut at the knot contains it once; one at the window's end belongs to the last
// segment.
std::unique_ptr<Segment> MakeSegment(const DriveTrack& track, const WindowData& data, TimeNs from,
                                     TimeNs to, const ParameterScaling& scaling, double max_block);

// Divides [from, to] evenly into steps of at most `interval` seconds; both ends are knots.
std::vector<TimeNs> EvenKnots(TimeNs from, TimeNs to, double interval);

// The process over a segment: decay, and weights by the covariance that it adds. drift_unit: rad
// for each unit of a node's drift.
ContinuityResidual::Weights StepWeights(const ProcessNoise& noise,
                                        const Eigen::Vector3d& drift_unit, const Segment& segment,
                                        double gravity);
// Log determinant of these weights, the gust's included if `gusts`.
double LogDeterminant(const ContinuityResidual::Weights& weights, bool gusts);

}  // namespace trueline
