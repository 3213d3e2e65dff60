#include "problems/estimators/estimators.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>

#include "problems/common/error.h"
#include "problems/ekf/ekf_run.h"
#include "problems/kinematic/vgd_kinematic.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

using Runner = std::function<EstimatorRun(const FlightData&, const EstimatorOptions&, int gamma)>;

EstimatorRun RunVgdAt(const FlightData& flight, const EstimatorOptions& options, int gamma) {
  VgdOptions vgd = options.vgd;
  vgd.gamma = gamma;
  return RunVgd(flight, vgd);
}

EstimatorRun RunKinematicAt(const FlightData& flight, const EstimatorOptions& options, int gamma) {
  VgdOptions vgd = options.vgd;
  vgd.gamma = gamma;
  return RunVgdKinematic(flight, vgd, options.kinematic);
}

EstimatorRun RunSmootherAt(const FlightData& flight, const EstimatorOptions& options, int gamma) {
  VgdOptions vgd = options.vgd;
  vgd.gamma = gamma;
  return RunSmoother(flight, vgd, options.smoother);
}

EstimatorRun RunEkfAt(const FlightData& flight, const EstimatorOptions& options, int gamma) {
  return RunEkf(flight, options.ekf, gamma);
}

const std::map<std::string, Runner>& Runners() {
  static const std::map<std::string, Runner> runners = {
      {"vgd", RunVgdAt},
      {"vgd_kinematic", RunKinematicAt},
      {"ekf", RunEkfAt},
      {"smoother", RunSmootherAt}};
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

bool HasWindows(const std::string& name) { return name != "ekf"; }

EstimatorRun RunEstimator(const std::string& name, const FlightData& flight,
                          const EstimatorOptions& options, int gamma) {
  CheckEstimator(name);
  return Runners().at(name)(flight, options, gamma);
}

EstimatorOptions ReadEstimatorOptions(const YamlMap& map) {
  EstimatorOptions options;
  options.ekf = ReadEkfOptions(map.ChildOrEmpty("ekf"));
  options.kinematic = ReadKinematicOptions(map.ChildOrEmpty("kinematic"));
  options.smoother = ReadSmootherOptions(map.ChildOrEmpty("smoother"));
  options.vgd = ReadVgdOptions(map);  // last: it refuses what nobody asked for
  return options;
}

YAML::Node ToYaml(const EstimatorOptions& options) {
  YAML::Node node = ToYaml(options.vgd);
  node["ekf"] = ToYaml(options.ekf);
  node["kinematic"] = ToYaml(options.kinematic);
  node["smoother"] = ToYaml(options.smoother);
  return node;
}

}  // namespace trueline
