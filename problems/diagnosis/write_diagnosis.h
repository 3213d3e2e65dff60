// The result files of trueline-diagnose: diagnosis.yaml, model.yaml, residuals.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& provenance,
                    const std::filesystem::path& directory);

// For standard output: verdict, causes, candidates with what would have been found.
std::string DiagnosisTable(const Diagnosis& diagnosis);

}  // namespace trueline
