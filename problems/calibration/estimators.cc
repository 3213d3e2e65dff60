#include "problems/calibration/estimators.h"

#include <fmt/ranges.h>

#include "problems/common/error.h"
#include "problems/ekf/ekf.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/vgd_kinematic.h"

namespace trueline {
namespace {

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

}  // namespace

const std::vector<EstimatorEntry>& AllEstimators() {
  static const std::vector<EstimatorEntry> all = {
      {.name = "ekf", .run = RunEkfAt, .windows = false, .carries_past = true},
      {.name = "smoother",
       .run = RunSmootherAt,
       .force_effects = true,
       .whole_flight = true,
       .carries_past = true},
      {.name = "vgd", .run = RunVgdAt, .force_effects = true},
      {.name = "vgd_kinematic", .run = RunKinematicAt}};
  return all;
}

const EstimatorEntry& FindEstimator(const std::string& name) {
  std::vector<std::string> known;
  for (const EstimatorEntry& entry : AllEstimators()) {
    if (entry.name == name) return entry;
    known.push_back(entry.name);
  }
  throw InputError(
      fmt::format("estimator '{}' is not known; use one of: {}", name, fmt::join(known, ", ")));
}

const std::vector<ProcessNoise>& Estimators::Processes() {
  if (!processes_) processes_ = LearnProcess(flight_, options_.vgd);
  return *processes_;
}

EstimatorRun Estimators::Run(const std::string& name, int gamma) {
  const EstimatorEntry& estimator = FindEstimator(name);
  if (flight_.passes.empty()) return {name, gamma, {}, flight_.warnings};
  return estimator.run(this, gamma);
}

void Serialize(YamlArchive* a, EstimatorOptions* o) {
  Serialize(a, &o->vgd);
  a->Nested("ekf", &o->ekf);
  a->Nested("kinematic", &o->kinematic);
  a->Nested("smoother", &o->smoother);
  a->Nested("whole_flight", &o->whole_flight);
}

}  // namespace trueline
