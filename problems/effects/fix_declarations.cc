// The declarations of errors of fixes (Li et al. 2019, eq. 15).
#include <functional>

#include "cost_functions/models/rotation.h"
#include "problems/effects/declaration.h"
#include "problems/log/samples.h"

namespace trueline {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr char kSpeedsAndGates[] = "pass gates of several headings at several speeds";

void UndoFixLatency(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  for (Fix& fix : log->fixes) {
    if (fix.gate >= 0) fix.t -= FromSeconds(effect["tau"]);
  }
}

// Calls undo(fix, vector in E to the gate) for all fixes of gates of the map.
void ForEachGateVector(FlightLog* log, const std::function<void(Fix*, const Vector3d&)>& undo) {
  for (Fix& fix : log->fixes) {
    const Gate* gate = GateOf(*log, fix.gate);
    if (gate != nullptr) undo(&fix, gate->position - fix.p_E);
  }
}

void UndoFixScale(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  ForEachGateVector(
      log, [s = effect["s"]](Fix* fix, const Vector3d& u_E) { fix->p_E += u_E - u_E / (1.0 + s); });
}

void UndoCameraMisalignment(const Effect& effect, const CorrectionContext& context,
                            FlightLog* log) {
  if (context.original.attitude.empty()) return;
  const Quaterniond turn =
      QuaternionFromEuler<double>(Vector3d(effect["roll"], effect["pitch"], effect["yaw"]));
  ForEachGateVector(log, [&](Fix* fix, const Vector3d& u_E) {
    const Quaterniond& q_E_B = AttitudeNear(context.original, fix->t);
    fix->p_E += u_E - q_E_B * (turn.conjugate() * (q_E_B.conjugate() * u_E));
  });
}

void UndoGateMoved(const Effect& effect, const CorrectionContext&, FlightLog* log) {
  const Vector3d d(effect["dx"], effect["dy"], effect["dz"]);
  for (Fix& fix : log->fixes) {
    if (fix.gate == static_cast<int>(effect["gate"])) fix.p_E += d;
  }
}

}  // namespace

std::vector<EffectInfo> FixDeclarations() {
  using enum EntersAt;
  return {
      {
          .id = "fix_latency",
          .enters = kFix,
          .parameters = {{"tau", "s", 0.005, 0.25, 0.004, false}},
          .physics = "fixes are stamped later than they were measured",
          .definition = "a fix stamped t was measured at t - tau",
          .separate_by = kSpeedsAndGates,
          .drawn = {{"tau", 0.03, 0.2}},
          .correct_at = CorrectionStage::kFixClock,
          .correct = UndoFixLatency,
      },
      {
          .id = "fix_scale",
          .enters = kFix,
          .parameters = {{"s", "1", 0.01, 0.5, 0.005}},
          .physics = "distances to gates are too long by a constant factor: wrong gate size or "
                     "focal length",
          .definition = "measured vector to the gate = (1 + s) times the true one",
          .separate_by = "see gates from far and near, at several speeds",
          .drawn = {{"s", 0.04, 0.3, true}},
          .correct_at = CorrectionStage::kGateVector,
          .correct = UndoFixScale,
      },
      {
          .id = "camera_misalignment",
          .enters = kFix,
          .parameters = {{"roll", "rad", 0.01, 0.3, 0.003},
                         {"pitch", "rad", 0.01, 0.3, 0.003},
                         {"yaw", "rad", 0.01, 0.3, 0.003}},
          .physics = "the camera's orientation differs from its calibration",
          .definition = "the vector to the gate is rotated by roll, pitch, yaw in body axes",
          .separate_by = "see gates from far and near, off the middle of the picture too",
          .drawn = {{"roll", 0.02, 0.15, true},
                    {"pitch", 0.03, 0.2, true},
                    {"yaw", 0.03, 0.2, true}},
          .correct_at = CorrectionStage::kGateVector,
          .correct = UndoCameraMisalignment,
      },
      {
          .id = "gate_moved",
          .enters = kFix,
          .parameters = {{"dx", "m", 0.02, 2.0, 0.02},
                         {"dy", "m", 0.02, 2.0, 0.02},
                         {"dz", "m", 0.02, 2.0, 0.02}},
          .physics = "a gate is not at its place on the map",
          .definition = "the gate stands at its map position + d",
          .separate_by = "pass the gate in both directions",
          .indices = {{"gate", "id"}},
          .drawn = {{"gate", 1.0, 1.0},
                    {"dx", 0.2, 1.0, true},
                    {"dy", 0.2, 1.0, true},
                    {"dz", 0.05, 0.4, true}},
          .correct_at = CorrectionStage::kMap,
          .correct = UndoGateMoved,
      },
      {
          .id = "false_gate",
          .enters = kFix,
          .parameters = {{"fraction", "1", 0.01, 0.9, 0.01, false}},
          .physics = "a share of the fixes shows another object than the gate",
          .definition = "this share of the fixes belongs to no gate of the map",
          .separate_by = "look at the pictures of the outlying fixes",
          .indices = {{"gate", "id"}, {"dx", "m"}, {"dy", "m"}, {"dz", "m"}},
          .drawn = {{"fraction", 0.05, 0.25},
                    {"dx", 0.5, 2.0, true},
                    {"dy", 0.5, 2.0, true},
                    {"dz", 0.1, 0.5, true}},
      },
  };
}

}  // namespace trueline
