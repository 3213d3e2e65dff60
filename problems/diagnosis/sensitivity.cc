#include "problems/diagnosis/sensitivity.h"

namespace trueline {
namespace {

// A log with the fixes, the map and the attitude, which is all that effects on fixes need.
FlightLog FixesOf(const FlightLog& log) {
  FlightLog light;
  light.gates = log.gates;
  light.fixes = log.fixes;
  light.attitude = log.attitude;
  light.imu = {log.imu.front()};
  return light;
}

// Fixes with the effects undone at the parameters and a step further: what a fix moves in place and
// in time. Rows are (position - fix) at the fix's time.
Eigen::VectorXd FixDifference(const SensitivityBase& base, const std::vector<Effect>& at,
                              const std::vector<Effect>& beyond, const BaseFlight& flight) {
  FlightLog light = FixesOf(base.log);
  // The fitted positions stand in for the fixes: vectors to gates that hold a fix's own noise would
  // go with its residual and show a scale where there is none.
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    light.fixes[base.plan.fixes[i]].p_E = flight.StateAtFix(i).head<3>();
  }
  const auto here = CorrectLog(light, at, base.path).fixes;
  const auto there = CorrectLog(light, beyond, base.path).fixes;
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(flight.rows());
  for (std::size_t i = 0; i < base.plan.fixes.size(); ++i) {
    const Fix &before = here[base.plan.fixes[i]], &after = there[base.plan.fixes[i]];
    const Eigen::Vector3d v_E = flight.StateAtFix(i).tail<3>();
    difference.segment<3>(3 * static_cast<int>(i)) =
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
  Eigen::VectorXd here;
  if (enters == EntersAt::kForce) here = ForceResiduals(at, x, flight);
  if (enters == EntersAt::kAttitude || enters == EntersAt::kAccelerometer) {
    here = DriveResiduals(base, at, x);
  }
  Eigen::MatrixXd columns(flight->rows(), infos.size());
  for (std::size_t i = 0; i < infos.size(); ++i) {
    Eigen::VectorXd moved = parameters;
    moved[static_cast<int>(i)] += infos[i].step;
    std::vector<Effect> beyond = base.effects;
    beyond.push_back(candidate.At(moved));
    auto column = columns.col(static_cast<int>(i));
    if (enters == EntersAt::kFix) {
      column = FixDifference(base, at, beyond, *flight) / infos[i].step;
    } else if (enters == EntersAt::kForce) {
      column = (ForceResiduals(beyond, x, flight) - here) / infos[i].step;
    } else {
      column = (DriveResiduals(base, beyond, x) - here) / infos[i].step;
    }
  }
  if (enters == EntersAt::kForce) flight->SetForceEffects(ForceEffectsOf(base.effects));
  return columns;
}

}  // namespace trueline
