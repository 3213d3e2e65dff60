// Runs of the NanoDrone benchmark (Busetto et al. 2026): states and rotor speeds at 100 Hz.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "cost_functions/multi_step_residual.h"

namespace trueline {

// Named columns of a CSV file, plain or compressed by gzip: a row for each line after the header, a
// column for each name; further columns are ignored. Throws InputError naming file, line and column
// for a file that is missing, cut off or lacks a number.
Eigen::MatrixXd ReadColumns(const std::filesystem::path& file,
                            const std::vector<std::string>& names);

// Whether the file's header names the column.
bool HasColumn(const std::filesystem::path& file, const std::string& name);

// The files of a folder whose names end in .csv or .csv.gz, sorted by name. Throws InputError where
// there are none.
std::vector<std::filesystem::path> ColumnFiles(const std::filesystem::path& folder);

// The file's name without .csv and .gz.
std::string NameOfColumnFile(const std::filesystem::path& file);

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
