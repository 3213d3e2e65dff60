#include "problems/calibration/own_model.h"

#include <fmt/format.h>

#include "problems/common/strict_yaml.h"

namespace trueline {

bool IsFittedTo(const std::string& model_file, const FlightLog& log) {
  constexpr char kStream[] = "imu.csv";
  const auto digest = log.sha256.find(kStream);
  const YamlMap model = YamlMap::FromFile(model_file);
  if (digest == log.sha256.end() || !model.Has("provenance")) return false;
  const YamlMap digests = model.Child("provenance").ChildOrEmpty("sha256");
  return digests.Get<std::string>(kStream, "") == digest->second;
}

std::string OwnModelWarning(const std::string& model_file) {
  return fmt::format(
      "{} was fitted to this very flight: its constants are not used as a prior, which would count "
      "the same data twice; its effects are. Give the model of another flight of the vehicle",
      model_file);
}

}  // namespace trueline
