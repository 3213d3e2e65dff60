// Which experiment a file of config/experiments describes.
#pragma once

#include <filesystem>
#include <string>

namespace trueline {

// Its `kind` (multi_step, wrench); empty for experiments with estimators, which have none.
std::string ExperimentKind(const std::filesystem::path& file);

}  // namespace trueline
