// The whole flight as one chain of segments: fixes and accelerometer x, y against the IMU-driven
// model (Li et al. 2019, eq. 15), with model errors as nuisances. The base fit that gives a
// diagnosis its residuals.
#pragma once

#include <ceres/cost_function.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "cost_functions/chain_node.h"
#include "problems/effects/effect.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/force_samples.h"
#include "problems/vgd/segment.h"

namespace trueline {

// The division of a flight into segments and rows. It comes from the log as recorded: a fix that an
// effect moves in time keeps its row.
struct FlightPlan {
  struct SegmentSpan {
    TimeNs begin, end;
    bool linked;  // a step to the next segment follows; false at the end of a stretch
    int cluster;  // a pass and the arc after it: the unit of the cluster variance
  };
  std::vector<SegmentSpan> segments;
  std::vector<std::size_t> fixes;   // indices into the log's fixes
  std::vector<std::size_t> forces;  // indices into the log's SmoothForces
  std::vector<int> fix_cluster;     // by entry of `fixes`
  std::vector<int> force_cluster;
  std::vector<TimeNs> cluster_starts;
  int clusters = 0;

  // Throws InputError if the flight has fewer than four clusters.
  static FlightPlan For(const FlightData& flight, const VgdOptions& options);

  int SegmentOf(TimeNs t) const;  // the nearest segment if t is outside
  int ClusterAt(TimeNs t) const;
};

struct FlightUnknowns {
  ThetaVector theta = ThetaVector::Zero();  // scaled as in WindowProblem
  std::vector<NodeVector> nodes;            // by segment
};

// Residuals and derivatives at one point, in physical units; rows in the order fixes (x, y, z
// each), forces (x, y each), links (p, v by segment).
struct FlightRows {
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  explicit FlightRows(int rows = 0, int slopes = 0)
      : r(Eigen::VectorXd::Zero(rows)),
        d_theta(RowMatrix::Zero(slopes, kThetaSize)),
        d_node(RowMatrix::Zero(slopes, kGustAt)),
        d_next(d_node),
        d_gust(RowMatrix::Zero(slopes, kGustSize)),
        d_next_gust(d_gust) {}

  Eigen::VectorXd r;  // m, m/s^2; links: m, m/s
  // Empty unless asked for: by theta, drift and state of the segment's node and of the next one,
  // and the gusts there.
  RowMatrix d_theta, d_node, d_next, d_gust, d_next_gust;
};

class BaseFlight {
 public:
  // `log` must already be corrected by the known effects; `plan` comes from the log as recorded.
  // All arguments must outlive this object.
  BaseFlight(const FlightLog& log, const FlightPlan& plan, const VgdOptions& options,
             const ForceEffects& force_effects);

  // Initial unknowns from the fixes alone.
  FlightUnknowns RoughStart(const std::vector<Pass>& passes) const;

  void SetForceEffects(const ForceEffects& effects);
  FlightRows Evaluate(const FlightUnknowns& x, bool derivatives);

  const FlightPlan& plan() const { return plan_; }
  const ParameterScaling& scaling() const { return scaling_; }
  const FlightLog& log() const { return log_; }
  const DriveTrack& track() const { return track_; }
  double gravity() const { return track_.gravity(); }
  const std::vector<ForceSample>& forces() const { return forces_; }
  const Segment& segment(int s) const { return *segments_[s]; }
  int measurement_rows() const {
    return static_cast<int>(3 * plan_.fixes.size() + 2 * plan_.forces.size());
  }
  int rows() const { return measurement_rows() + 6 * static_cast<int>(plan_.segments.size()); }
  // Indices of the measurement rows of a segment, and the properties of a row.
  const std::vector<int>& RowsOfSegment(int segment) const { return segment_rows_[segment]; }
  bool IsFix(int row) const { return row < static_cast<int>(3 * plan_.fixes.size()); }
  double FixSigma(int row) const { return log_.fixes[plan_.fixes[row / 3]].sigma; }
  int ClusterOfRow(int row) const {
    const int forces_at = static_cast<int>(3 * plan_.fixes.size());
    return IsFix(row) ? plan_.fix_cluster[row / 3] : plan_.force_cluster[(row - forces_at) / 2];
  }
  // First row of a link.
  int LinkRow(int segment) const { return measurement_rows() + 6 * segment; }
  // The fitted state (p, v) at the time of fix i of the plan, after Evaluate.
  Eigen::Matrix<double, 6, 1> StateAtFix(std::size_t i) const;

 private:
  struct Reading {
    std::unique_ptr<ceres::CostFunction> residual;  // in physical units
    int segment;
  };

  void BuildSegments(const VgdOptions& options);
  void AddReadings();
  // The segment of a sample, and the time at which it is evaluated: clamped to the segment if an
  // effect shifted it outside.
  std::pair<int, TimeNs> PlaceOf(TimeNs t) const {
    const int s = plan_.SegmentOf(t);
    return {s, std::clamp(t, plan_.segments[s].begin + 1, plan_.segments[s].end)};
  }
  // The node whose gusts act at a segment's end: the next one, or its own if none follows.
  const NodeVector& NextOf(int s, const FlightUnknowns& x) const {
    return x.nodes[plan_.segments[s].linked ? s + 1 : s];
  }
  void LinkRows(int s, const FlightUnknowns& x, FlightRows* rows) const;

  const FlightLog& log_;
  const FlightPlan& plan_;
  ParameterScaling scaling_;
  DriveTrack track_;
  std::vector<ForceSample> forces_;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<Reading> readings_;  // fixes, then forces
  std::vector<std::vector<int>> segment_rows_;
};

}  // namespace trueline
