// The result files of trueline-diagnose --drive=rotors: diagnosis.yaml, model.yaml (which
// trueline-calibrate --drive=rotors takes), residuals.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/rotor_diagnosis/rotor_diagnosis.h"

namespace trueline {

void WriteRotorDiagnosis(const RotorDiagnosis& diagnosis, const YAML::Node& provenance,
                         const std::filesystem::path& directory);

// The result as a table for standard output.
std::string RotorDiagnosisTable(const RotorDiagnosis& diagnosis);

}  // namespace trueline
