// The result files of trueline-calibrate (calibration.yaml, arcs.csv, trajectory.csv, windows.csv,
// residuals.csv, model.yaml), and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "problems/calibration/calibration.h"
#include "problems/calibration/rotor_calibration.h"

namespace trueline {

// Pieces of the result files and tables that calibrations of both drives share.
inline constexpr char kWindowsHeader[] =
    "log,estimator,gamma,tau,t_start [s],t_end [s],parameter,value,sigma,unit,status";
// A row of windows.csv; `window` holds its fields up to t_end.
void WriteParameterRow(std::ostream& out, const std::string& window, const ParameterEstimate& p);

// The start of calibration.yaml: verdict, reasons, warnings.
YAML::Node VerdictNode(const Verdict& verdict, const std::vector<std::string>& warnings);
YAML::Node ParameterNode(const std::vector<ParameterEstimate>& parameters);

// The content that --model takes: the vehicle's parameters after this flight, and effects beyond
// the model's equations that came with a given model (a calibration finds none).
YAML::Node ModelNode(const std::vector<ParameterEstimate>& parameters,
                     const std::vector<Effect>& effects, const YAML::Node& provenance);

// Lines of the table: combinations that the flight does not show, and the verdict with its reasons.
std::string UnobservableText(const std::vector<std::string>& combinations);
std::string VerdictText(const Verdict& verdict);

// Times in the CSV files are the log's own, in seconds.
void WriteCalibration(const Calibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory);

// version, log, checksums, seed and the resolved configuration; under `further` the flights of the
// vehicle that were fitted together with `log`.
YAML::Node Provenance(const FlightLog& log, std::uint64_t seed, const YAML::Node& config,
                      std::span<const FlightLog> further = {});

// For standard output: arcs against gamma, parameters, verdict.
std::string CalibrationTable(const Calibration& calibration);

// The result files of trueline-calibrate --drive=rotors.

// calibration.yaml, model.yaml, trajectory.csv, windows.csv (the filter's estimates every half
// second, and the batch's at the end) and predictions.csv. Each file is written whole or not at
// all.
void WriteCalibration(const RotorCalibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory);

// The result as a table for standard output.
std::string CalibrationTable(const RotorCalibration& calibration);

}  // namespace trueline
