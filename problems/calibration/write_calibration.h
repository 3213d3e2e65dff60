// The result files of trueline-calibrate (calibration.yaml, arcs.csv, trajectory.csv, windows.csv,
// residuals.csv, model.yaml), and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/calibration/calibration.h"

namespace trueline {

// Times in the CSV files are the log's own, in seconds.
void WriteCalibration(const Calibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory);

// version, log, checksums, seed and the resolved configuration; under `further` the flights of the
// vehicle that were fitted together with `log`.
YAML::Node Provenance(const FlightLog& log, std::uint64_t seed, const YAML::Node& config,
                      std::span<const FlightLog> further = {});

// For standard output: arcs against gamma, parameters, verdict.
std::string CalibrationTable(const Calibration& calibration);

}  // namespace trueline
