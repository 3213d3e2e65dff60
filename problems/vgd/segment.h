// One segment of a window: its chain of blocks and the nodes at which residuals read it.
#pragma once

#include <optional>
#include <vector>

#include "cost_functions/models/gust.h"
#include "cost_functions/segment_node.h"
#include "problems/vgd/vgd_options.h"
#include "problems/window/motion_chain.h"

namespace trueline {

// Means and sigmas that take the scaled unknowns to parameters: parameter = mean + sigma * scaled.
struct ParameterScaling {
  Eigen::Matrix<double, kThetaSize, 1> mean, sigma;

  explicit ParameterScaling(const VgdOptions& options);

  // rad for each unit of a drift block.
  Eigen::Vector3d DriftUnit() const { return sigma.segment<kDriftSize>(kAhrsInTheta); }
};

class Segment {
 public:
  // `times` ascending and unique in [start, end]; the last one is `end`. `scaling` must outlive
  // the segment.
  Segment(const DriveTrack& track, TimeNs start, std::vector<TimeNs> times,
          const std::vector<TimeNs>& force_times, const ParameterScaling& scaling,
          double max_block);

  // Integrates from the given scaled parameters (sizes kThetaSize, kDriftSize, kStateSize) and
  // fills all nodes; their derivatives only where asked for.
  void Evaluate(const double* theta, const double* drift, const double* state, bool derivatives);
  // Adds what gusts do to the values of all nodes; to be called once after Evaluate.
  void AddGusts(const GustPair& gusts);

  // Near to where derivatives were taken last, nodes follow those from now on and nothing is
  // integrated: within 0.01 mm over a second. For problems that are solved again and again.
  void FollowDerivatives() { follows_ = true; }

  // Force beyond linear drag; the track's unless replaced.
  void SetForceEffects(const ForceEffects& effects) { effects_ = effects; }

  const StateNode* StateAt(TimeNs t) const { return &states_[IndexOf(t)]; }
  const ForceNode* ForceAt(TimeNs t) const;
  // Derivatives of these nodes to the gusts at the segment's ends.
  Eigen::Matrix<double, 6, 4> StateGustsAt(TimeNs t) const;
  Eigen::Matrix<double, 2, 4> ForceGustsAt(TimeNs t) const;
  int force_count() const { return static_cast<int>(forces_.size()); }
  // Body x and y in E where the first force is measured (zero without), to the AHRS's error.
  Eigen::Matrix<double, 3, 2> BodyAxesAtStart() const;
  const StateNode* end_node() const { return &states_.back(); }
  TimeNs start() const { return chain_.start(); }
  TimeNs end() const { return chain_.times().back(); }
  const std::vector<TimeNs>& times() const { return chain_.times(); }

 private:
  std::size_t IndexOf(TimeNs t) const;
  template <typename T>
  void Integrate(const ImuDrivenParameters<T>& parameters, const MotionState<T>& start,
                 const double* b_a);

  // What the integration starts from: theta with drift (scaled), state.
  struct Inputs {
    Eigen::Matrix<double, kThetaSize, 1> theta;
    Eigen::Matrix<double, kStateSize, 1> state;
  };
  bool IsNear(const Inputs& at) const;
  void Linearise(const Inputs& at);
  void Extrapolate(const Inputs& to);

  struct Force {
    std::size_t time_index;
    double t;  // s from the log's start
    Drive drive;
    double thrust;  // m/s^2, a short mean
    ForceNode node;
  };
  const Force& FindForce(TimeNs t) const;
  Eigen::Matrix<double, 2, 4> ForceByGusts(const Force& force) const;

  MotionChain chain_;
  const ParameterScaling* scaling_;
  double gravity_;
  ForceEffects effects_;
  std::vector<StateNode> states_;
  std::vector<Force> forces_;  // ascending in time
  bool follows_ = false;
  // Where the nodes' derivatives were taken, and their values there (without gusts).
  std::optional<Inputs> linearised_at_;
  std::vector<Eigen::Matrix<double, kStateSize, 1>> states_there_;
  std::vector<Eigen::Vector2d> forces_there_;
};

}  // namespace trueline
