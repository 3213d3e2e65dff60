// The numbers of a stabilised process in configurations and results.
#pragma once

#include "cost_functions/models/stabilised_process.h"
#include "problems/common/yaml_archive.h"

namespace trueline {

void Serialize(YamlArchive* a, StabilisedProcessNumbers* numbers);

}  // namespace trueline
