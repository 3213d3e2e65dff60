// The least-squares problem of one window: the last gamma passes and the arc after them.
#pragma once

#include <optional>
#include <vector>

#include "problems/vgd/correlated_fixes.h"
#include "problems/vgd/drag_errors.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/rough_path.h"
#include "problems/vgd/segment_chain.h"

namespace trueline {

// The marginalised past as a prior on a window's first unknowns, theta and the first node, in the
// units of the parameter blocks. The residual is sqrt_information * (x - mean).
struct WindowPrior {
  static constexpr int kSize = kThetaSize + kGustAt;  // without a gust
  Eigen::VectorXd mean;
  Eigen::MatrixXd sqrt_information;  // square
  DragErrors drag_errors;            // on the drag, from the marginalised past
};

// The unknowns, residuals and integration of a window. Segments end at knots, where process noise
// acts; without process noise one segment spans the window.
class WindowProblem {
 public:
  // `past` replaces the options' priors.
  WindowProblem(const DriveTrack& track, const WindowData& data, const VgdOptions& options,
                const std::optional<WindowPrior>& past = std::nullopt);

  // Of the prior that keeps covariances finite, in 1 / prior sigmas.
  static constexpr double kOpenWeight = 0.01;
  static double PriorWeight(const VgdOptions& options) {
    return options.ranges == RangeUse::kPrior ? 1.0 : kOpenWeight;
  }

  // Initialises all unknowns: parameters to theta, states to the rough path, and beyond the path's
  // end by integration.
  void SetStart(const Theta& theta, const RoughPath& path);

  ceres::Solver::Summary Solve();

  // Holds the shared parameters at SetStart's values, or frees them.
  void HoldParameters(bool hold) { chain_.HoldTheta(hold); }

  // The solution in physical units, in the order of theta.
  static constexpr int kParameters = kThetaSize;
  Eigen::Matrix<double, kParameters, 1> Parameters() const;
  // True if b_ax, b_ay are unknowns of the problem.
  bool HasForces() const { return chain_.HasForces(); }

  // Covariance of (parameters in units of their prior sigma, final p and v) by the Gauss-Newton
  // Hessian. Finite also where the data leave directions open: the prior bounds them. A fit without
  // prior has one a hundred times as wide (kOpenWeight) for this purpose alone.
  Eigen::Matrix<double, kParameters + 6, kParameters + 6> Covariance() {
    return FindUncertainty().cov;
  }
  // The same, and the statistics of the velocity and its uncertainty where the accelerometer
  // measures drag.
  struct Uncertainty {
    Eigen::Matrix<double, kParameters + 6, kParameters + 6> cov;
    DragErrors drag_errors;
  };
  Uncertainty FindUncertainty();

  // Log marginal likelihood of the data given the options, by Laplace's approximation at the
  // optimum (the current unknowns), up to a constant that does not depend on `process`, the prior
  // of a pass's offset, or `past`.
  double LogEvidence() { return chain_.LogEvidence(); }

  // The prior on the unknowns from `t` on (where a pass begins) given the flight before `t`: all
  // residuals before t linearised at the current unknowns, with the states before t marginalised.
  // Call FindUncertainty first.
  WindowPrior Marginalise(TimeNs t);

  // State at the window's end, in E: the predicted final point. Where the fixes have a delay, the
  // position that a fix shows there.
  Eigen::Matrix<double, 6, 1> FinalState() const;
  // The delay of the fixes in s, with FindUncertainty's sigma; empty where it is not estimated.
  struct Delay {
    double value, sigma;
  };
  std::optional<Delay> FixLatency() const;

  // Integrates with the current unknowns; readings then hold the fitted trajectory.
  void Refresh(bool derivatives) { chain_.Refresh(derivatives); }
  const std::vector<std::unique_ptr<Segment>>& segments() const { return chain_.segments(); }
  // Fitted position at the time of a fix of this window.
  Eigen::Vector3d PositionAt(TimeNs t) const;
  const ParameterScaling& scaling() const { return chain_.scaling(); }
  // The same cost as a problem of Ceres'.
  ceres::Problem& problem() { return chain_.problem(); }

 private:
  struct Offset {
    TimeNs begin;  // of its pass
    TimeNs end;
    double* value;
  };

  void BuildSegments(const DriveTrack& track, const WindowData& data);
  void AddOffsets(const WindowData& data);
  void AddFixes(const WindowData& data);
  bool HasCorrelatedFixes(const WindowData& data) const {
    return data.noise.IsCorrelated() && options_.process.Any();
  }
  void AddPriors();
  void AddPast(const WindowPrior& past);
  void HoldOpenDirections();
  std::size_t SegmentOf(TimeNs t) const { return chain_.SegmentAt(t, 0, chain_.size()); }

  VgdOptions options_;
  SegmentChain chain_;
  std::vector<Offset> offsets_;                    // ascending in time
  std::optional<CorrelatedFixes> correlated_;      // their delay is the first of the border
  double delay_variance_ = 1.0;                    // of its unit, set by FindUncertainty
  bool open_ = false;                              // motion's parameters have no prior
  DragErrors past_drag_errors_, own_drag_errors_;  // own: set by FindUncertainty
};

}  // namespace trueline
