// The result files of trueline-diagnose: diagnosis.yaml, model.yaml (which every --model takes),
// residuals.csv, misfit.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& provenance,
                    const std::filesystem::path& directory);

// The table for standard output: verdict, causes, candidates with their detectable sizes.
std::string DiagnosisTable(const Diagnosis& diagnosis);

}  // namespace trueline
