#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "problems/simulators/audit.h"

namespace trueline {

// audit.yaml and the corrected files.
void WriteAudit(const Audit& audit, const std::filesystem::path& directory);
// For standard output.
std::string AuditTable(const Audit& audit);

}  // namespace trueline
