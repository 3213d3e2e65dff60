// The least-squares problem of whole flights of one vehicle, in one sparse chain.
//
// A section reaches from one pass to the next. It holds theta and, as windows do, segments with a
// state and an AHRS drift each. From section to section b_a and the AHRS error do a random walk;
// the airframe's parameters are tied. Flights follow each other in the chain: only the airframe's
// tie continues between flights. All couplings are between neighbours, so the cost is linear
// in the flight's length.
#pragma once

#include <ceres/ceres.h>

#include <array>
#include <map>
#include <memory>
#include <vector>

#include "problems/smoother/whole_flight.h"
#include "problems/vgd/correlated_fixes.h"
#include "problems/vgd/drag_errors.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/segment_chain.h"

namespace trueline {

struct FlightProblemOptions {
  VgdOptions vgd;
  SmootherOptions walks;
  std::array<bool, 2> drag_shows = {true, true};  // K_x, K_y: false holds it at its prior's mean
};

class FlightProblem {
 public:
  FlightProblem(const std::vector<FlightShare>& flights, const FlightProblemOptions& options);

  // Initialises from the fixes and the priors' means, or from another problem with the same knots.
  void SetStart();
  void StartFrom(const SegmentChain::Unknowns& x) { chain_.StartFrom(x); }
  const SegmentChain::Unknowns& unknowns() const { return chain_.unknowns(); }

  ceres::Solver::Summary Solve();

  // As WindowProblem's: logarithm of the marginal likelihood by Laplace's approximation.
  double LogEvidence() { return chain_.LogEvidence(); }

  // Means over all flights of theta in prior sigmas, with drift where the AHRS error drifts.
  struct Means {
    ThetaVector value = ThetaVector::Zero();
    Eigen::MatrixXd cov;
    DragErrors drag_errors;
    double force_sigma = 0.0;  // m/s^2, the largest of the flights'
  };
  Means MeanUnknowns();

  std::vector<TrajectoryPoint> Trajectory() const;
  const ParameterScaling& scaling() const { return chain_.scaling(); }
  bool HasForces() const { return chain_.HasForces(); }

 private:
  // A pass and the arc after it; its parameters are theta(index).
  struct Section {
    int flight;
    int pass;  // index in its flight
    TimeNs begin, end;
    std::size_t first_segment, end_segment;
    bool continues;  // no break since the section before
  };

  bool HasCorrelatedFixes(const FlightData& flight) const {
    return flight.continuous && flight.continuous->noise.IsCorrelated();
  }
  WindowData DataOf(const FlightData& flight, int k, bool arc) const;
  std::vector<TimeNs> KnotsOf(const FlightData& flight, const WindowData& data) const;
  // One after the last section that continues from `section` without a break.
  std::size_t EndOfRun(std::size_t section) const;
  void AddCorrelatedFixes();
  void BuildSections();
  void AddOffsets();
  void AddParameterPriors(std::size_t section);
  void AddParameterStep(std::size_t section);
  void AddMeasurements(std::size_t section);
  void AddFix(const Fix& fix, std::size_t section);
  void AddProcess(std::size_t section);
  double ForceSigma(const FlightData& flight) const {
    return options_.vgd.drag_measurement.scale * flight.forces.sigma;
  }

  std::vector<FlightShare> flights_;
  FlightProblemOptions options_;
  SegmentChain chain_;
  std::vector<Section> sections_;
  std::map<std::size_t, double*> offsets_;     // of false passes, by section
  std::map<int, CorrelatedFixes> correlated_;  // by flight
};

}  // namespace trueline
