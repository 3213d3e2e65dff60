// The accelerometer against twice differentiated position: a = R(t) L f + g, for the matrix L that
// takes what is read to the body.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "problems/inspection/motion.h"

namespace trueline {

// Force and axes of the body in the earth of an attitude, twice integrated, for bends of any width.
class BodyForce {
 public:
  BodyForce(const FlightLog& log, const std::vector<AttitudeSample>& attitude);

  double gravity() const { return gravity_; }
  bool Knows(const Bend& bend) const;
  // Along an earth axis under the bend's triangle: element 3 k + l is column k of the rotation
  // times reading l [m/s^2]; element k is column k.
  Eigen::Matrix<double, 9, 1> Force(int earth_axis, const Bend& bend) const;
  Eigen::Vector3d Axes(int earth_axis, const Bend& bend) const;

 private:
  double gravity_;  // m/s^2
  std::array<RunningIntegral<9>, 3> force_;
  std::array<RunningIntegral<3>, 3> axes_;
};

struct ForceFit {
  double as_read = 0.0;   // m/s^2, rms of the residual by axis, for L a multiple of 1
  double residual = 0.0;  // the same for multiples of `turn`
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // orthogonal
  double clearly = 0.0;                                // sigmas by which `turn` is better than none
};

// `bends` in the earth axes of `attitude`. `hints`: turns to try beside the 48 permutations. No
// value for fewer than kFewest bends that both streams know.
std::optional<ForceFit> FitForce(const BodyForce& force, const std::vector<Bend>& bends,
                                 const std::vector<Eigen::Matrix3d>& hints);

// Truth = factor * reading + (x, y, 0), or reading + bias, in the body, by the same equations:
// three unknowns each.
struct ForceScale {
  double factor, sigma;       // sigma by the jackknife
  Eigen::Vector3d bias;       // m/s^2, of the second
  double by_factor, by_bias;  // m/s^2, rms of the residual
};
std::optional<ForceScale> FitForceScale(const BodyForce& force, const std::vector<Bend>& bends);

// Acceleration of positions = value (R f + g) + R b: the scale of distances beside a bias b of the
// accelerometer in the body, which also stands for a tilt of its axes. On laps of one direction b
// turns as the acceleration does and looks like a scale in every part of the flight, so that the
// jackknife alone does not show it: `sigma` contains what a usual b leaves open.
struct PositionScale {
  double value, sigma;
};
std::optional<PositionScale> FitPositionScale(const BodyForce& force,
                                              const std::vector<Bend>& bends);

// m/s^2, rms by axis of what a multiple of L = `turn` leaves; infinite for fewer than kFewest
// bends.
double ForceResidual(const BodyForce& force, const std::vector<Bend>& bends,
                     const Eigen::Matrix3d& turn);

// Rows x and y of L, nine free numbers: what the body's lateral force is made of. Both are small
// beside thrust, so that a wrong axis hardly shows in the residual; drag is read from nothing else.
// A bias in the body stands beside L: drag at a steady speed looks like one.
struct LateralForce {
  Eigen::Matrix<double, 2, 3> share;  // of the readings along x, y, z
  Eigen::Matrix<double, 2, 3> sigma;  // by the jackknife, and by what a usual bias leaves open
};
std::optional<LateralForce> FitLateralForce(const BodyForce& force, const std::vector<Bend>& bends);

}  // namespace trueline
