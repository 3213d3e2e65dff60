// The whole flight as one chain of segments: fixes and accelerometer x, y against the IMU-driven
// model (Li et al. 2019, eq. 15), with model errors as nuisances. The base fit that gives a
// diagnosis its residuals.
#pragma once

#include <memory>
#include <vector>

#include "cost_functions/chain_node.h"
#include "problems/diagnosis/smooth_forces.h"
#include "problems/effects/effect.h"
#include "problems/vgd/flight_data.h"
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

  Eigen::VectorXd r;                  // m, m/s^2; links: m, m/s
  RowMatrix d_node, d_next, d_theta;  // empty unless asked for
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
  void BuildSegments(const VgdOptions& options);
  void FixRow(std::size_t i, const FlightUnknowns& x, FlightRows* rows) const;
  void ForceRow(std::size_t i, const FlightUnknowns& x, FlightRows* rows) const;
  void LinkRows(int s, const FlightUnknowns& x, FlightRows* rows) const;

  const FlightLog& log_;
  const FlightPlan& plan_;
  ParameterScaling scaling_;
  DriveTrack track_;
  std::vector<ForceSample> forces_;
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<int> fix_segment_, force_segment_;
  std::vector<std::vector<int>> segment_rows_;
};

}  // namespace trueline
