// observability.yaml, and the table for standard output.
#pragma once

#include <string>
#include <vector>

#include "problems/observability/observe.h"

namespace trueline {

std::string ObservabilityYaml(const std::vector<CaseResult>& cases, const std::string& source);

// One block for each case: rank, null space in words and numbers, sigmas, advice.
std::string ObservabilityTable(const std::vector<CaseResult>& cases);

}  // namespace trueline
