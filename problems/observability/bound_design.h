// Designs flights on the Cramer-Rao bound of the batch calibration. Unlike the Gramian of Boehm et
// al. 2020 the bound includes disturbances, sensor rates, prior and considered effects. The result
// is the best of many random Lissajous figures, then evolved with overtones.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/calibration/rotor_calibration.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

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
