// The result files of trueline-calibrate --drive=rotors.
#pragma once

#include <filesystem>
#include <string>

#include "problems/calibration/rotor_calibration.h"

namespace trueline {

// calibration.yaml, model.yaml, trajectory.csv, windows.csv (the filter's estimates every half
// second, and the batch's at the end) and predictions.csv. Each file is written whole or not at
// all.
void WriteCalibration(const RotorCalibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory);

// The result as a table for standard output.
std::string CalibrationTable(const RotorCalibration& calibration);

}  // namespace trueline
