// Files and table of a design.
#pragma once

#include <filesystem>
#include <string>

#include "problems/observability/run_design.h"

namespace trueline {

// trajectory.yaml, trajectory.csv and score.yaml in `directory`.
void WriteDesign(const DesignTask& task, const DesignOutcome& outcome,
                 const std::filesystem::path& directory);

std::string DesignTable(const DesignTask& task, const DesignOutcome& outcome);

}  // namespace trueline
