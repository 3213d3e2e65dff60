// The result of an inspection as a file and as a table for people.
#pragma once

#include <filesystem>
#include <string>

#include "problems/inspection/inspection.h"

namespace trueline {

// `corrected`: the command that converts by the corrected map; empty without one. `log`: what was
// inspected.
std::string InspectionYaml(const Inspection& inspection, const std::string& log,
                           const std::string& corrected);
std::string InspectionTable(const Inspection& inspection);

}  // namespace trueline
