// Trajectories to compare with and to advise: random ones, Lissajous figures, plain manoeuvres.
#pragma once

#include <string>
#include <vector>

#include "problems/common/random.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

// Shape of a spline flight that starts and ends at rest at the origin.
struct SplineShape {
  double duration = 20.0;  // s
  int pieces = 40;
  int degree = 7;  // continuous up to the sixth derivative: rotor speeds are smooth

  // Two pieces a second.
  static SplineShape Lasting(double duration);
  int num_control() const { return pieces + degree; }
  int num_free() const { return num_control() - 2 * degree; }
};

// All control points from the free ones: rest, free, rest.
FlatMatrix RestToRest(const SplineShape& shape, const FlatMatrix& free);

// Free control points, Gaussian: position `size` m, yaw `yaw_size` rad, each one sigma.
FlatMatrix RandomControl(const SplineShape& shape, double size, double yaw_size, Random* random);

// a_i sin(2 pi f_i t + phase_i) about the origin, for x, y, z and yaw.
struct Lissajous {
  Eigen::Vector4d amplitude = Eigen::Vector4d::Zero();  // m, m, m, rad
  Eigen::Vector4d frequency = Eigen::Vector4d::Zero();  // Hz
  Eigen::Vector4d phase = Eigen::Vector4d::Zero();      // rad
};
// Random amplitudes (up to `size` m and `yaw_size` rad), frequencies (0.1 to 1.5 Hz) and phases.
Lissajous RandomFigure(double size, double yaw_size, Random* random);
PiecewisePolynomial LissajousPath(const Lissajous& figure, double duration);

// Named simple manoeuvres within 1 m, for advice on what to fly.
struct Manoeuvre {
  std::string name;
  Lissajous figure;
};
std::vector<Manoeuvre> PlainManoeuvres();

}  // namespace trueline
