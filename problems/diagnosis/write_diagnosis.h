// The result files of trueline-diagnose: diagnosis.yaml, model.yaml (which every --model takes),
// residuals.csv, misfit.csv; and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

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

// On the terminal, in diagnosis.yaml and on the page: what the verdict means, in one sentence.
std::string VerdictMeaning(const Diagnosis& diagnosis);

// What a user does next, the most useful step first; never empty.
std::vector<std::string> NextSteps(const Diagnosis& diagnosis);

}  // namespace trueline
