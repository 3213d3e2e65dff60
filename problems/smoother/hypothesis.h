// Which passes of a window saw their gate: several readings of the same data, compared by evidence.
#pragma once

#include <ceres/ceres.h>

#include <memory>
#include <optional>
#include <set>

#include "problems/vgd/window_problem.h"
#include "problems/window/flight_data.h"

namespace trueline {

// What a false pass is (something else was taken for the gate), and how rare.
struct FalsePassOptions {
  double probability = 0.05;  // of a pass, before its fixes are looked at; 0: never
  double offset = 2.0;        // m, sigma of its fixes' common error, each axis
  double offset_rate = 0.2;   // m/s, sigma of that error's change: what is seen may be nearer
  // That the past itself misled, so that the path starts anew (parameters are kept).
  double lost_probability = 0.001;
};

// One reading, solved.
struct Hypothesis {
  std::set<int> false_passes;  // indices among the flight's
  bool lost = false;           // the path starts anew
  WindowData data;
  std::unique_ptr<WindowProblem> problem;
  ceres::Solver::Summary summary;
  double log_probability = 0.0;  // up to a constant of the window
};

// A window in which the readings are compared: passes first ... tau - 1 of the flight.
struct WindowQuestion {
  const FlightData& flight;
  const VgdOptions& vgd;
  const FalsePassOptions& options;
  Theta start;
  int first;
  int tau;
  std::optional<WindowPrior> past;
  std::optional<WindowPrior> past_if_lost;  // empty: not asked
};

// Solves the window under one reading.
Hypothesis SolveUnder(const WindowQuestion& question, const std::set<int>& false_passes, bool lost);

// The most probable reading, found by flipping one pass at a time, from `last` (the decision on the
// window before) on. While the newest pass agrees with a marginalised past, nothing else is tried.
Hypothesis MostProbable(const WindowQuestion& question, const std::set<int>& last);

}  // namespace trueline
