// The least-squares problem of whole flights of one vehicle, in one sparse chain.
//
// A section reaches from one pass to the next. It holds theta and, as windows do, segments with a
// state and an AHRS drift each. From section to section b_a and the AHRS error do a random walk;
// the airframe's parameters are tied. Flights follow each other in the chain: only the airframe's
// tie continues between flights. All couplings are between neighbours except those of the
// detector's unknowns, so the cost is linear in the flight's length.
#pragma once

#include <ceres/ceres.h>

#include <Eigen/SparseCore>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "cost_functions/mounted_fix_residual.h"
#include "problems/smoother/smoother.h"
#include "problems/vgd/drag_doubt.h"
#include "problems/vgd/gust_blocks.h"
#include "problems/vgd/segment.h"
#include "problems/window/flight_data.h"

namespace trueline {

// Optional unknowns, by the sigma of their prior; zero: not estimated.
struct DetectorUnknowns {
  double fix_latency = 0.0;          // s
  double camera_misalignment = 0.0;  // rad, each axis
  double gate_offset = 0.0;          // m, each axis of each gate

  bool Any() const { return fix_latency > 0.0 || camera_misalignment > 0.0 || gate_offset > 0.0; }
};

// A flight with its learned process and held parameters; it must outlive the problem.
struct FlightShare {
  const FlightData* flight;
  std::set<int> false_passes;                    // indices of passes whose fixes do not count
  int passes = std::numeric_limits<int>::max();  // use the first so many passes
};

struct FlightProblemOptions {
  VgdOptions vgd;
  SmootherOptions walks;
  DetectorUnknowns detector;
  std::array<bool, 2> drag_shows = {true, true};  // K_x, K_y: false holds it at its prior's mean
};

class FlightProblem : private ceres::EvaluationCallback {
 public:
  FlightProblem(const std::vector<FlightShare>& flights, const FlightProblemOptions& options);
  FlightProblem(const FlightProblem&) = delete;
  FlightProblem& operator=(const FlightProblem&) = delete;

  // Initialises from the fixes and the priors' means, or from another problem with the same knots.
  void SetStart();
  void StartFrom(const FlightProblem& other);

  ceres::Solver::Summary Solve();

  // As WindowProblem's: logarithm of the marginal likelihood by Laplace's approximation.
  double LogEvidence();

  // The reported values: means over all flights of theta in prior sigmas (with drift where the AHRS
  // error drifts), then the mount's unknowns, then the gates' by id.
  struct Means {
    Eigen::VectorXd value;
    Eigen::MatrixXd cov;
    DragDoubt doubt;
    double force_sigma = 0.0;  // m/s^2, the largest of the flights'
  };
  Means MeanUnknowns();
  std::vector<int> GateIds() const;

  std::vector<TrajectoryPoint> Trajectory() const;
  const ParameterScaling& scaling() const { return scaling_; }
  std::size_t segment_count() const { return segments_.size(); }
  bool HasForces() const { return has_forces_; }

 private:
  struct Section {
    int flight;
    TimeNs begin, end;
    std::size_t first_segment;
    bool continues;  // no break since the section before
  };
  struct Unknowns {
    std::vector<Eigen::Matrix<double, kThetaSize, 1>> theta;  // by section
    std::vector<Eigen::Vector3d> drift;                       // by segment
    std::vector<Eigen::Matrix<double, 6, 1>> states;          // by segment
    std::vector<Eigen::Vector2d> gusts;                       // by segment, or none

    bool operator==(const Unknowns&) const = default;
  };

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;
  void Refresh(bool derivatives);
  void BuildSections();
  void AllocateUnknowns();
  void AllocateGusts();
  void AddFlightPriors(std::size_t section);
  void HoldDrag(std::size_t section);
  void AddStep(std::size_t section);
  void AddMeasurements(std::size_t section);
  void AddFix(const Fix& fix, std::size_t segment, const FlightShare& share, double* offset,
              TimeNs pass_begin);
  void AddContinuity(std::size_t section);
  std::vector<double*> Blocks(std::size_t segment);
  std::size_t SegmentAt(std::size_t section, TimeNs t) const;
  std::size_t EndOf(std::size_t section) const;
  std::vector<double*> OrderedBlocks();
  Eigen::SparseMatrix<double> Hessian();

  std::vector<FlightShare> flights_;
  FlightProblemOptions options_;
  ParameterScaling scaling_;
  std::vector<Section> sections_;
  std::vector<int> passes_;  // by section: index of its pass in its flight
  std::vector<std::unique_ptr<Segment>> segments_;
  std::vector<std::size_t> section_of_;  // by segment
  Unknowns x_;
  Unknowns integrated_;
  bool has_derivatives_ = false;
  Eigen::Matrix<double, kMountSize, 1> mount_ = Eigen::Matrix<double, kMountSize, 1>::Zero();
  std::map<int, Eigen::Vector3d> gates_;                        // by id
  std::map<std::size_t, Eigen::Matrix<double, 6, 1>> offsets_;  // of false passes, by section
  ceres::Problem problem_;
  GustBlocks gusts_;
  bool has_forces_ = false;
  double log_weights_ = 0.0;
};

}  // namespace trueline
