// Designs flights on the Cramer-Rao bound of the batch calibration. Unlike the Gramian of Boehm et
// al. 2020 the bound includes disturbances, sensor rates, prior and considered effects. The result
// is the best of many random Lissajous figures, then evolved with overtones.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

// Minimises a function without derivatives that has kinks where limits are active: an evolution
// strategy with a diagonal covariance (sep-CMA-ES, Ros and Hansen 2008). A trust region in 29
// unknowns (BOBYQA) stops at such a kink.

struct EvolveOptions {
  int evaluations = 1800;
  double step = 0.1;  // of the first generation, in the units given
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores; the result does not depend on it
  std::function<void(int tried, double best)> watch = nullptr;  // called after each tenth
};

struct Evolved {
  Eigen::VectorXd x;  // the best of all that were tried, the start included
  double value = 0.0;
};

// `unit`: scale of each coordinate. `cost` may be infinite for infeasible x.
Evolved Evolve(const std::function<double(const Eigen::VectorXd&)>& cost,
               const Eigen::VectorXd& start, const Eigen::VectorXd& unit,
               const EvolveOptions& options);

// Lissajous figures with overtones: each axis repeats a tone and its multiples, and yaw turns
// steadily. Few unknowns with smooth rotor speeds, for designs without derivatives.
inline constexpr int kTones = 3;
// Frequency (Hz), then sine and cosine parts.
inline constexpr Eigen::Index kToneUnknowns = 1 + 2 * kTones;
inline constexpr int kOvertoneUnknowns = kFlatOutputs * kToneUnknowns + 1;

// x, y, z (m), yaw (rad), kToneUnknowns each; then the turn (rad/s).
using Overtones = Eigen::Matrix<double, kOvertoneUnknowns, 1>;

Overtones OvertonesOf(const Lissajous& figure);
// A useful search scale of each unknown, for figures of `size` m and `yaw_size` rad.
Overtones OvertoneUnits(double size, double yaw_size);
// Frequencies are clamped to 0.05 to 1.5 Hz. The amplitude grows from rest at the origin within
// `ramp` seconds and falls as slowly at the end; 0: the figure starts and ends in motion.
PiecewisePolynomial OvertonePath(const Overtones& figure, double duration, double ramp);

struct BoundDesign {
  RotorSimulation simulation;
  RotorPrior prior;
  std::vector<ConsideredEffect> considered;  // see calibration/considered.h
  std::vector<int> show;                     // constants whose bound is judged
  double duration = 20.0;                    // s
  double ramp = 0.0;       // s, in which a figure swells from rest; 0: it begins in motion
  int candidates = 40;     // random figures
  int evaluations = 1800;  // of the evolution; 0: the best figure as it is
  std::uint64_t seed = 1;
  int threads = 0;  // 0: all cores; the result does not depend on it
};

struct DesignedFigure {
  PiecewisePolynomial path;
  double start_bound = 0.0;  // of the best candidate, as FlownBound
};

// Bounds (sigma, considered effects included) of all constants on a flight along `path`; empty if
// it cannot be flown within 0.1 m.
std::vector<double> FlownSigmas(const BoundDesign& design, const PiecewisePolynomial& path);
// Mean variance bound of `design.show`, in units of the prior's variance; infinite if the flight
// cannot be flown.
double FlownBound(const BoundDesign& design, const PiecewisePolynomial& path);

// Throws InputError if none of the figures can be flown.
DesignedFigure DesignFigure(const BoundDesign& design,
                            const std::function<void(const std::string&)>& progress);

}  // namespace trueline
