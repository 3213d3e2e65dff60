// The result files of trueline-diagnose --against (diagnosis.yaml, trims.csv), and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/against/comparison.h"

namespace trueline {

void WriteComparison(const Comparison& comparison, const YAML::Node& provenance,
                     const std::filesystem::path& directory);

// One row a flight, that under judgement first with session -1.
void WriteTrims(const Comparison& comparison, const std::filesystem::path& path);

// Adds the comparison to the node of a diagnosis of the whole log: causes by the trim join its
// causes, the verdict is the worse one, all else stands under `trim`.
void AddComparison(const Comparison& comparison, YAML::Node* diagnosis);

// For standard output: what is named, in words, and the trims.
std::string ComparisonTable(const Comparison& comparison);

}  // namespace trueline
