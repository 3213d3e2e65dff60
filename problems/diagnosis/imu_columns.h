// Columns of a flight on the IMU-driven model: derivatives of its rows by effect parameters
// (difference quotients at the base solution, the flight's own unknowns held), and the linearised
// fit that has them.
#pragma once

#include <array>
#include <vector>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/candidate.h"
#include "problems/diagnosis/linearisation.h"
#include "problems/diagnosis/open_term.h"

namespace trueline {

// The linearisation point of sensitivities.
struct SensitivityBase {
  const FlightLog& log;  // as recorded
  const FlightPlan& plan;
  const VgdOptions& options;
  const std::vector<Effect>& effects;       // in the model, the candidate not among them
  const std::vector<VelocitySample>& path;  // of the base solution
};

// Columns (rows of FlightRows x parameters) of one candidate, in addition to the base's effects, at
// `parameters`. `flight` has been evaluated at `x` with the base's effects and the candidate;
// `here` are its residuals. It is left in that state.
Eigen::MatrixXd Sensitivity(const SensitivityBase& base, const Candidate& candidate,
                            const Eigen::VectorXd& parameters, const FlightUnknowns& x,
                            const Eigen::VectorXd& here, BaseFlight* flight);

// Columns without a prior, at zero. A column that overflows on this flight (a term in the cube of a
// place 14 km away) is zero: it carries no information, and its products with other columns would
// overflow.
Columns FreeColumns(const Eigen::MatrixXd& d_rows);

class ImuLinearisation : public Linearisation {
 public:
  // `fit` with `columns`, its own first; the first `ordinary_errors` are integrated out where noise
  // is learned. Only Relearn needs `fit` later.
  ImuLinearisation(std::shared_ptr<const BaseFlight> flight, const BaseFit& fit,
                   int ordinary_errors, Columns columns, const NoiseStrengths& noise,
                   ColumnPlaces places);

  std::vector<Relearned> Relearn(const std::vector<std::vector<int>>& sets) const override;

 private:
  std::shared_ptr<const BaseFlight> flight_;
  const BaseFit& fit_;
  int ordinary_errors_;
  Columns columns_;
};

// The open catalogue (open_term.h) on the IMU drive: forces, attitude errors and errors of fixes
// along a fitted flight as columns of its rows.
class ImuOpenTerms {
 public:
  // At the solution `x`; `flight` must outlive this object. `parts` of a segment, each with one
  // motion: four are about the spacing of the force samples, which take it, too, where a segment
  // has but one.
  ImuOpenTerms(BaseFlight* flight, const FlightUnknowns& x, int parts = 4);

  // Evenly in time.
  std::vector<TermMotion> Motions() const;
  // One unit of each term, by row of FlightRows.
  Eigen::MatrixXd Columns(const std::vector<TermForm>& terms) const;

 private:
  struct Motion : TermMotion {
    Eigen::Vector3d f_E = Eigen::Vector3d::Zero();  // m/s^2, along the thrust axis
  };
  // A part of a segment over which forces are held.
  struct Part {
    Motion motion;  // at its middle
    double begin;   // s, from the segment's begin
    double length;  // s
  };

  Motion At(const FlightUnknowns& x, int segment, TimeNs t) const;
  static Eigen::Vector3d Acceleration(const TermForm& term, const Motion& at);
  Eigen::VectorXd Column(const TermForm& term) const;

  const BaseFlight& flight_;
  Eigen::Matrix3d R_E_Ep_, R_I_B_;
  std::array<TermSeries, 3> rates_;       // rad/s, in I
  std::vector<std::vector<Part>> parts_;  // by segment
  std::vector<Motion> at_forces_;         // by force sample
  std::vector<Motion> at_fixes_;
};

}  // namespace trueline
