#include "problems/diagnosis/sensitivity.h"

#include "problems/common/parallel.h"

namespace trueline {
namespace {

// A log with fixes, map and attitude only: effects on fixes need nothing else.
FlightLog FixesOf(const FlightLog& log) {
  FlightLog light;
  light.gates = log.gates;
  light.fixes = log.fixes;
  light.attitude = log.attitude;
  light.imu = {log.imu.front()};
  return light;
}

// Change of the corrected fixes, in place and time, between two parameter values. Rows are
// (position - fix) at the fix's time.
Eigen::VectorXd FixDifference(const SensitivityBase& base, const std::vector<Effect>& at,
                              const std::vector<Effect>& beyond, const BaseFlight& flight) {
  FlightLog light = FixesOf(base.log);
  // The fitted positions replace the fixes: the noise of a fix would enter the vector to the gate,
  // correlate with the fix's own residual, and look like a scale error.
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    light.fixes[base.plan.fixes[i]].p_E = flight.StateAtFix(i).head<3>();
  }
  const auto here = CorrectLog(light, at, base.path).fixes;
  const auto there = CorrectLog(light, beyond, base.path).fixes;
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(flight.rows());
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    const Fix &before = here[base.plan.fixes[i]], &after = there[base.plan.fixes[i]];
    const Eigen::Vector3d v_E = flight.StateAtFix(i).tail<3>();
    difference.segment<3>(3 * static_cast<Eigen::Index>(i)) =
        v_E * SecondsBetween(before.t, after.t) - (after.p_E - before.p_E);
  }
  return difference;
}

Eigen::VectorXd DriveResiduals(const SensitivityBase& base, const std::vector<Effect>& effects,
                               const FlightUnknowns& x) {
  const FlightLog log = CorrectLog(base.log, effects, base.path);
  BaseFlight flight(log, base.plan, base.options, ForceEffectsOf(effects));
  return flight.Evaluate(x, false).r;
}

Eigen::VectorXd ForceResiduals(const std::vector<Effect>& effects, const FlightUnknowns& x,
                               BaseFlight* flight) {
  flight->SetForceEffects(ForceEffectsOf(effects));
  return flight->Evaluate(x, false).r;
}

}  // namespace

Eigen::MatrixXd Sensitivity(const SensitivityBase& base, const Candidate& candidate,
                            const Eigen::VectorXd& parameters, const FlightUnknowns& x,
                            BaseFlight* flight) {
  const auto& infos = candidate.info->parameters;
  const EntersAt enters = candidate.info->enters;
  std::vector<Effect> at = base.effects;
  at.push_back(candidate.At(parameters));
  const Eigen::VectorXd here =
      enters == EntersAt::kForce ? ForceResiduals(at, x, flight) : flight->Evaluate(x, false).r;
  Eigen::MatrixXd columns(flight->rows(), infos.size());
  const auto fill = [&](int i) {
    Eigen::VectorXd moved = parameters;
    moved[i] += infos[i].step;
    std::vector<Effect> beyond = base.effects;
    beyond.push_back(candidate.At(moved));
    if (enters == EntersAt::kFix) {
      columns.col(i) = FixDifference(base, at, beyond, *flight) / infos[i].step;
    } else if (enters == EntersAt::kForce) {
      columns.col(i) = (ForceResiduals(beyond, x, flight) - here) / infos[i].step;
    } else {
      columns.col(i) = (DriveResiduals(base, beyond, x) - here) / infos[i].step;
    }
  };
  // Force effects change the shared flight object, so they run in one thread.
  const int threads = enters == EntersAt::kForce ? 1 : 0;
  ParallelFor(static_cast<int>(infos.size()), threads, fill);
  if (enters == EntersAt::kForce) flight->SetForceEffects(ForceEffectsOf(base.effects));
  return columns;
}

}  // namespace trueline
