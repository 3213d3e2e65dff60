// The result files of trueline-diagnose: diagnosis.yaml, model.yaml, residuals.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/diagnosis/diagnosis.h"

namespace trueline {

void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& provenance,
                    const std::filesystem::path& directory);

// Parts that the diagnosis of the rotor-driven model also writes.
YAML::Node CauseNode(const Cause& cause);
YAML::Node CandidateNode(const CandidateReport& report);
YAML::Node EffectsNode(const std::vector<Cause>& causes);  // in the format of model.yaml
std::string CandidateLines(const std::vector<CandidateReport>& candidates);
std::string CauseText(const Cause& cause);

// The table for standard output: verdict, causes, candidates with their detectable sizes.
std::string DiagnosisTable(const Diagnosis& diagnosis);

}  // namespace trueline
