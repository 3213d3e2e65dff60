// Pieces of the result files and tables that calibrations of both drives share.
#pragma once

#include <yaml-cpp/yaml.h>

#include <ostream>
#include <string>
#include <vector>

#include "problems/calibration/calibration.h"

namespace trueline {

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

}  // namespace trueline
