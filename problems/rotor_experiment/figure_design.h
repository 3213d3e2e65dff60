// Figures chosen by the Cramer-Rao bound of the batch that will read them: the best of many random
// Lissajous figures, and that one with overtones, evolved.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "problems/rotor_batch/rotor_batch.h"
#include "problems/rotor_simulation/simulate_rotor_flight.h"
#include "problems/trajectory/piecewise_polynomial.h"

namespace trueline {

struct FigureDesign {
  const RotorSimulation& simulation;
  const RotorPrior& prior;
  std::vector<int> by;     // constants whose bound is judged
  double duration = 20.0;  // s
  int best_of = 40;        // random figures
  int evaluations = 0;     // of the evolution from the best of them; 0: the best as it is
  std::uint64_t seed = 1;
  int threads = 0;  // 0: all cores; the result does not depend on it
};

// Mean variance bound of `design.by`, in units of the prior, of a flight along `path`; infinite
// where it can't be flown within 0.1 m.
double FlownBound(const FigureDesign& design, const PiecewisePolynomial& path);

// Throws InputError where none of the figures can be flown.
PiecewisePolynomial DesignFigure(const FigureDesign& design,
                                 const std::function<void(const std::string&)>& progress);

}  // namespace trueline
