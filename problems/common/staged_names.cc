#include "problems/common/staged_names.h"

#include <map>
#include <mutex>

namespace trueline {
namespace {

std::mutex mutex;
std::map<std::string, std::string>& Stages() {
  static std::map<std::string, std::string> stages;
  return stages;
}

}  // namespace

void NameStage(const std::filesystem::path& stage, const std::filesystem::path& final_name) {
  const std::lock_guard lock(mutex);
  Stages()[stage.string()] = final_name.string();
}

std::string WithFinalNames(std::string text) {
  const std::lock_guard lock(mutex);
  for (const auto& [stage, name] : Stages()) {
    for (std::size_t at = 0; (at = text.find(stage, at)) != std::string::npos;) {
      text.replace(at, stage.size(), name);
      at += name.size();
    }
  }
  return text;
}

}  // namespace trueline
