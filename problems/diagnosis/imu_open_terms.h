// The open catalogue (open_term.h) on the IMU drive: forces, attitude errors and errors of fixes
// along a fitted flight as columns of its rows.
#pragma once

#include <array>
#include <vector>

#include "problems/diagnosis/base_fit.h"
#include "problems/diagnosis/open_term.h"

namespace trueline {

inline constexpr int kTermParts = 4;  // of a segment: about the spacing of the force samples

class ImuOpenTerms {
 public:
  // At the solution `x`; `flight` must outlive this object. `parts` of a segment, each with one
  // motion; where a segment has but one, force samples take it, too.
  ImuOpenTerms(BaseFlight* flight, const FlightUnknowns& x, int parts = kTermParts);

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
