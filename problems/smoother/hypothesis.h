// Hypotheses on which passes of a window are false, compared by evidence.
#pragma once

#include <ceres/ceres.h>

#include <memory>
#include <optional>
#include <set>

#include "problems/smoother/smoother.h"
#include "problems/vgd/flight_data.h"
#include "problems/vgd/window_problem.h"

namespace trueline {

// One hypothesis, solved.
struct Hypothesis {
  std::set<int> false_passes;  // indices among the flight's
  bool lost = false;           // the path starts anew
  WindowData data;
  std::unique_ptr<WindowProblem> problem;
  ceres::Solver::Summary summary;
  double log_probability = 0.0;  // up to a constant that all hypotheses share
};

// The window on which hypotheses are compared: passes first ... tau - 1 of the flight.
struct WindowQuestion {
  const FlightData& flight;
  const VgdOptions& vgd;
  const FalsePassOptions& options;
  Theta start;
  int first;
  int tau;
  std::optional<WindowPrior> past;
  std::optional<WindowPrior> past_if_lost;  // empty: `lost` is not tested
};

// Solves the window under one hypothesis.
Hypothesis SolveUnder(const WindowQuestion& question, const std::set<int>& false_passes, bool lost);

// The most probable hypothesis, found by flipping one pass at a time from `last` (the decision on
// the window before). If the newest pass agrees with a marginalised past, no alternative is tested.
Hypothesis MostProbable(const WindowQuestion& question, const std::set<int>& last);

}  // namespace trueline
