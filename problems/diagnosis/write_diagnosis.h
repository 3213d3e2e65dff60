// The result files of trueline-diagnose: diagnosis.yaml, model.yaml (which every --model takes),
// residuals.csv, misfit.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

// The content of diagnosis.yaml.
YAML::Node DiagnosisNode(const Diagnosis& diagnosis, const YAML::Node& provenance);

// `result`: DiagnosisNode(), to which others may have added.
void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& result,
                    const std::filesystem::path& directory);

// For standard output: verdict, causes, what to do next. It fits on one screen.
std::string DiagnosisTable(const Diagnosis& diagnosis);
// For standard output: all that was tried, with detectable sizes.
std::string CandidateTable(const Diagnosis& diagnosis);

}  // namespace trueline
