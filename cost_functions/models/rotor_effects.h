// Effects on a rotor-driven vehicle beyond RotorDrivenModel, off by default. With t the time since
// the flight's first sample:
//   thrust sag          k_f is multiplied by 1 - d t
//   rotor loss          one rotor's k_f is multiplied by a factor; its reaction moment is not
//   ground effect       thrust is multiplied by 1 / (1 - (k / h)^2), h the height above p_z = 0
//   payload, com steps  mass and its centre change at given times
//   rotor tilt          all rotors' axes are turned by roll and pitch
// The physics of forces and moments of the air stands where the effect is declared
// (problems/effects), that of terms of the open catalogue in term_force.h.
#pragma once

#include <ceres/jet.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <vector>

#include "cost_functions/models/rigid_body.h"
#include "cost_functions/models/rotor_constants.h"
#include "cost_functions/models/term_force.h"

namespace trueline {

// The air at the vehicle at one instant.
template <class T>
struct RotorAirFlow {
  Vec3<T> v_B;       // m/s, air-relative velocity
  double speed_sum;  // rad/s, sum of the rotor speeds
};

// From `time` (s) on, mass is added and its centre moved.
struct LoadStep {
  double time;
  double mass = 0.0;              // kg
  Eigen::Vector2d com{0.0, 0.0};  // dx, dy, m
};

struct RotorEffects {
  // Four columns of derivatives at a time, or (in tests) all errors of RotorAeroModel.
  using Jet = ceres::Jet<double, 4>;
  using FullJet = ceres::Jet<double, 12 + static_cast<int>(std::size(kRotorConstants))>;
  using AirTerm = ForScalars<RotorAirFlow, Vec3, double, Jet, FullJet>;

  double thrust_sag = 0.0;          // d, 1/s
  std::map<int, double> weak = {};  // rotor's index and factor
  double ground = 0.0;              // k, m
  std::vector<LoadStep> load_steps = {};
  double tilt_roll = 0.0;            // rad
  double tilt_pitch = 0.0;           // rad
  std::vector<AirTerm> forces = {};  // m/s^2, specific force beyond thrust, in body axes
  std::vector<AirTerm> moments;      // N m, beyond thrust's, about the centre of mass

  // Add term(size, air), unless the size is zero.
  template <class Function>
  void AddForce(double size, const Function& term) {
    Add(size, term, &forces);
  }
  template <class Function>
  void AddMoment(double size, const Function& term) {
    Add(size, term, &moments);
  }
  std::vector<SizedTerm> terms = {};

  // The factor on a rotor's thrust, without the ground effect.
  double ThrustFactor(int rotor, double t) const {
    const auto entry = weak.find(rotor);
    return (1.0 - thrust_sag * t) * (entry != weak.end() ? entry->second : 1.0);
  }
  // Rotation from rotor axes as built to the actual ones.
  Eigen::Matrix3d Tilt() const {
    return (Eigen::AngleAxisd(tilt_pitch, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(tilt_roll, Eigen::Vector3d::UnitX()))
        .toRotationMatrix();
  }
  double AddedMass(double t) const {
    double mass = 0.0;
    for (const LoadStep& step : load_steps) mass += t >= step.time ? step.mass : 0.0;
    return mass;
  }
  // Displacement of the centre of mass from its place as built, m.
  Eigen::Vector3d CentreShift(double t) const {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (const LoadStep& step : load_steps) {
      if (t >= step.time) shift.head<2>() += step.com;
    }
    return shift;
  }
  // The formula of Cheeseman and Bennett is valid down to about one radius: (k / h)^2 is clamped to
  // 0.81, also at and below the floor.
  template <class T>
  T GroundFactor(const T& height) const {
    constexpr double kMost = 0.81;
    if (ground == 0.0) return T(1.0);
    if (height < T(ground / 0.9)) return T(1.0 / (1.0 - kMost));
    return T(1.0) / (T(1.0) - T(ground * ground) / (height * height));
  }
  template <class T>
  static void AddTo(Vec3<T>* sum, const std::vector<AirTerm>& terms, const RotorAirFlow<T>& air) {
    for (const AirTerm& term : terms) *sum += term(air);
  }

 private:
  template <class Function>
  static void Add(double size, const Function& term, std::vector<AirTerm>* terms) {
    if (size == 0.0) return;
    terms->emplace_back(
        [=]<class T>(const RotorAirFlow<T>& air) -> Vec3<T> { return term(size, air); });
  }
};

}  // namespace trueline
