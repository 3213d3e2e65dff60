// A course of gates: corners rounded by arcs (lines and arcs), or way points joined by a spline.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/simulation/config.h"

namespace trueline::simulation {

// A closed path in space with a speed profile, as a table over arc length.
// The reference at one arc length. Frame E (NED), m, m/s, m/s^2, rad, rad/s.
struct PathPoint {
  Eigen::Vector3d p_E = Eigen::Vector3d::Zero();
  Eigen::Vector3d v_E = Eigen::Vector3d::Zero();
  Eigen::Vector3d a_E = Eigen::Vector3d::Zero();  // smoothed where curvature jumps
  double speed = 0.0;
  double heading = 0.0;  // of the tangent, continuous along the table
  double heading_rate = 0.0;
};

struct SpeedLimits {
  double along;    // m/s^2
  double lateral;  // m/s^2
};

class Path {
 public:
  // `points` is one round, evenly spaced to within a factor of two, without repeating the first
  // point at the end; `speeds` is the wanted speed at each point, lowered to the limits.
  Path(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& speeds,
       const SpeedLimits& limits);

  // Linear interpolation at arc length `s` (m), wrapped round.
  PathPoint At(double s) const;
  double length() const { return length_; }
  // Distance (m) from `p_E` to the nearest point of the table within `reach` m of arc length `s`.
  double DistanceTo(const Eigen::Vector3d& p_E, double s, double reach) const;

 private:
  int Wrap(int index) const;
  void LimitSpeeds(const SpeedLimits& limits);
  void FillDerivatives();
  void SmoothAccelerations(double window);

  std::vector<double> s_;
  std::vector<PathPoint> table_;
  double length_ = 0.0;
};

struct Course {
  Path path;
  std::vector<Gate> gates;  // the map; yaw is the flight direction
};

// Empty if the course can be flown, else what is wrong with it and how to correct it.
std::string CheckCourse(const CourseConfig& config);

// Throws InputError with CheckCourse's text.
Course BuildCourse(const CourseConfig& config);

}  // namespace trueline::simulation
