// The open catalogue: terms that no named effect states. A grammar makes them: what a term changes,
// along which axis, and what it goes with.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "problems/effects/declaration.h"

namespace trueline {

// How the vehicle moves at one time: what a term may go with.
struct TermMotion {
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();  // m/s, over ground
  Eigen::Vector3d w_B = Eigen::Vector3d::Zero();  // rad/s
  double thrust = 0.0;                            // m/s^2, above hover
  Eigen::Matrix3d R_E_B = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_E = Eigen::Vector3d::Zero();  // m
  double s = 0.0;                                 // time from -1 to 1 over the flight

  double Heading() const;  // rad
};

// What a term changes: the specific force [m/s^2] or the angular acceleration [rad/s^2] that acts
// on the vehicle, or the attitude that is logged [rad].
enum class TermOn { kForce, kTurn, kAttitude };

// A number that changes along the flight.
struct TermVariable {
  std::string name, unit;
  int factors;  // in its formula
  std::function<double(const TermMotion&)> value;
  bool local = false;  // a part of the course
};

struct OpenTerm {
  TermOn on;
  int axis;  // 0 to 2: x, y, z of B; 3, 4, 5: north, east, down
  TermVariable with;

  // One unit of it, in body axes.
  Eigen::Vector3d At(const TermMotion& at) const;
  std::string Name() const;    // "force along x_B with pitch rate"
  std::string Enters() const;  // force | moment | attitude
  std::string Along() const;   // x_B, ..., north, ...
  std::string Unit() const;    // of its size: "m/s^2 for each rad/s"
  // "a force along x_B of 1.5 +- 0.2 m/s^2 for each rad/s of pitch rate"
  std::string Text(double size, double sigma) const;
  // How long the formula is. A force that goes with the vehicle mostly turns with it, too.
  int Length() const { return 2 * with.factors + (axis < 3 ? 0 : 1); }
  // Known physics of this form; empty if there is none.
  std::string Physics() const;
};

struct SizeWithSigma {
  double value = 0.0, sigma = 0.0;
};

// A term of another flight of the vehicle.
struct TermRepeat {
  std::string log;
  SizeWithSigma size;
  bool repeats = false;  // of the same sign, p < 0.05, and 0.5 to 2 times the size or within sigmas
};

struct DescribedTerm {
  OpenTerm term;
  SizeWithSigma size;  // in term.Unit()
  double p = 1.0;      // after the correction for the number of terms tried
  int tried = 0;
  std::array<SizeWithSigma, 2> halves;  // by blocks of the flight in turn, A B A B
  std::vector<std::string> alike;       // names of terms that fit as well
  std::vector<TermRepeat> repeats;      // by further flight
};

// One of the terms tested singly, before any is taken.
struct TermSize {
  std::string name, unit;
  SizeWithSigma size;
  double p = 1.0;  // of this test alone
};

struct OpenCatalogue {
  std::vector<DescribedTerm> described;
  std::vector<TermSize> tested;
};

// Velocities, rates, thrust, their products and squares; heading; place on the course flown, in
// linear form and as humps where the flight has been; height; time.
std::vector<TermVariable> TermVariables(const std::vector<TermMotion>& flight);

// Forces along horizontal axes of B and E, and attitude errors, for both drives. The rotor drive
// also has forces along z_B and moments: the IMU drive measures the former and has no latter. What
// goes with a part of the course acts along axes of E.
std::vector<OpenTerm> OpenTerms(DriveKind drive, const std::vector<TermMotion>& flight);

}  // namespace trueline
