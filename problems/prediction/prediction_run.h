// Runs of the NanoDrone benchmark (Busetto et al. 2026): states and rotor speeds at 100 Hz.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cost_functions/multi_step_residual.h"

namespace trueline {

// World z up, body forward-left-up.
struct PredictionRun {
  std::string name;
  std::string trajectory;  // the name up to its first '_'
  // p [m], v [m/s], q w x y z (body to world), w [rad/s] in the body; 13 x rows.
  Eigen::Matrix<double, 13, Eigen::Dynamic> states;
  Eigen::Matrix<double, 4, Eigen::Dynamic> speeds;  // rad/s, held from row to row

  int num_windows() const { return static_cast<int>(states.cols()) - PredictionWindow::kSteps; }
};

// All runs of a folder, by name. Throws InputError naming file and remedy for files that are no
// runs of 10 ms, or are shorter than one window.
std::vector<PredictionRun> ReadPredictionRuns(const std::filesystem::path& folder);

// The window that starts at `row`: the state there and the speeds of the rows from there on. The
// speed over a step is the root mean square of the speeds at its ends; over the last one it is
// held.
PredictionWindow WindowAt(const PredictionRun& run, int row);
WindowTruth TruthAfter(const PredictionRun& run, int row);

}  // namespace trueline
