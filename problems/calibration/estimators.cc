#include "problems/calibration/estimators.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>

#include "problems/common/error.h"
#include "problems/ekf/ekf_run.h"
#include "problems/kinematic/vgd_kinematic.h"
#include "problems/vgd/learn_process.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

using RunFunction = std::function<EstimatorRun(Estimators*, int gamma)>;

VgdOptions WithGamma(const Estimators& estimators, int gamma) {
  VgdOptions vgd = estimators.options().vgd;
  vgd.gamma = gamma;
  return vgd;
}

EstimatorRun RunVgdAt(Estimators* e, int gamma) {
  return RunVgd(e->flight(), WithGamma(*e, gamma), e->Processes());
}

EstimatorRun RunKinematicAt(Estimators* e, int gamma) {
  return RunVgdKinematic(e->flight(), WithGamma(*e, gamma), e->options().kinematic);
}

EstimatorRun RunSmootherAt(Estimators* e, int gamma) {
  return RunSmoother(e->flight(), WithGamma(*e, gamma), e->options().smoother, e->Processes());
}

EstimatorRun RunEkfAt(Estimators* e, int gamma) {
  return RunEkf(e->flight(), e->options().ekf, gamma);
}

const std::map<std::string, RunFunction>& Runners() {
  static const std::map<std::string, RunFunction> runners = {{"vgd", RunVgdAt},
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

const std::vector<ProcessNoise>& Estimators::Processes() {
  if (!processes_) processes_ = LearnProcess(flight_, options_.vgd);
  return *processes_;
}

EstimatorRun Estimators::Run(const std::string& name, int gamma) {
  CheckEstimator(name);
  if (flight_.passes.empty()) return {name, gamma, {}, flight_.warnings};
  return Runners().at(name)(this, gamma);
}

EstimatorOptions ReadEstimatorOptions(const YamlMap& map) {
  EstimatorOptions options;
  options.ekf = ReadEkfOptions(map.ChildOrEmpty("ekf"));
  options.kinematic = ReadKinematicOptions(map.ChildOrEmpty("kinematic"));
  options.smoother = ReadSmootherOptions(map.ChildOrEmpty("smoother"));
  options.whole_flight = ReadWholeFlightOptions(map.ChildOrEmpty("whole_flight"));
  options.vgd = ReadVgdOptions(map);  // last: it rejects keys that were never asked for
  return options;
}

YAML::Node ToYaml(const EstimatorOptions& options) {
  YAML::Node node = ToYaml(options.vgd);
  node["ekf"] = ToYaml(options.ekf);
  node["kinematic"] = ToYaml(options.kinematic);
  node["smoother"] = ToYaml(options.smoother);
  node["whole_flight"] = ToYaml(options.whole_flight);
  return node;
}

}  // namespace trueline
