#include "problems/prediction/experiment_kind.h"

#include "problems/common/strict_yaml.h"

namespace trueline {

std::string ExperimentKind(const std::filesystem::path& file) {
  return YamlMap::FromFile(file).Get<std::string>("kind", "");
}

}  // namespace trueline
