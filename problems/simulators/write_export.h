#pragma once

#include <filesystem>
#include <string>

#include "problems/simulators/export_vehicle.h"

namespace trueline {

// Writes the files, the first as `out`, others beside it under its name with their own extension;
// and OUT.lost.yaml.
void WriteExport(const Export& exported, const Target& target, const std::filesystem::path& out);

// What is lost, in words.
std::string LossText(const Export& exported, const Target& target);

}  // namespace trueline
