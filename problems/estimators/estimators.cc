#include "problems/estimators/estimators.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>

#include "problems/common/error.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

using Runner = std::function<EstimatorRun(const FlightData&, const EstimatorOptions&, int gamma)>;

EstimatorRun RunVgdAt(const FlightData& flight, const EstimatorOptions& options, int gamma) {
  VgdOptions vgd = options.vgd;
  vgd.gamma = gamma;
  return RunVgd(flight, vgd);
}

const std::map<std::string, Runner>& Runners() {
  static const std::map<std::string, Runner> runners = {{"vgd", RunVgdAt}};
  return runners;
}

}  // namespace

const std::vector<std::string>& KnownEstimators() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, runner] : Runners()) list.push_back(name);
    return list;
  }();
  return names;
}

void CheckEstimator(const std::string& name) {
  if (Runners().count(name) > 0) return;
  throw InputError(fmt::format("estimator '{}' is not known; use one of: {}", name,
                               fmt::join(KnownEstimators(), ", ")));
}

EstimatorRun RunEstimator(const std::string& name, const FlightData& flight,
                          const EstimatorOptions& options, int gamma) {
  CheckEstimator(name);
  return Runners().at(name)(flight, options, gamma);
}

EstimatorOptions ReadEstimatorOptions(const YamlMap& map) { return {ReadVgdOptions(map)}; }

YAML::Node ToYaml(const EstimatorOptions& options) { return ToYaml(options.vgd); }

}  // namespace trueline
