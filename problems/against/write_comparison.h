// The result files of trueline-diagnose --against (diagnosis.yaml, trims.csv), and its table.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/against/comparison.h"

namespace trueline {

void WriteComparison(const Comparison& comparison, const YAML::Node& provenance,
                     const std::filesystem::path& directory);

// The same beside a diagnosis of the whole log, whose files `directory` has: causes by the trim
// join its causes, all else stands under `trim`. Returns the verdict of both.
std::string AddComparison(const Comparison& comparison, const std::filesystem::path& directory);

// For standard output: what is named, in words, and the trims.
std::string ComparisonTable(const Comparison& comparison);

}  // namespace trueline
