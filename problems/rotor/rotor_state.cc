#include "problems/rotor/rotor_state.h"

namespace trueline {
namespace {

using Model = RotorAeroModel;

}  // namespace

RotorState Plus(const RotorState& x, const RotorError& error) {
  const Vec3<double> theta = error.head<3>();
  const double angle = theta.norm();
  const double factor = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
  Vec4<double> turn;
  turn << std::cos(0.5 * angle), factor * theta;
  RotorState moved;
  moved.head<4>() = HamiltonProduct(Vec4<double>(x.head<4>()), turn).normalized();
  moved.tail<Model::kStates - 4>() =
      x.tail<Model::kStates - 4>() + error.tail<Model::kErrors - 3>();
  return moved;
}

RotorError Minus(const RotorState& a, const RotorState& b) {
  const Vec4<double> turn =
      HamiltonProduct(Conjugate(Vec4<double>(a.head<4>())), Vec4<double>(b.head<4>()));
  RotorError error;
  error.head<3>() = (turn[0] < 0.0 ? -2.0 : 2.0) * turn.tail<3>();
  error.tail<Model::kErrors - 3>() = b.tail<Model::kStates - 4>() - a.tail<Model::kStates - 4>();
  return error;
}

void SeedErrors(const RotorState& x, RotorJet* out) {
  for (int i = 0; i < Model::kStates; ++i) out[i] = RotorJet(x[i]);
  for (int column = 0; column < Model::kErrors; ++column) SeedError(x, column, column, out);
}

RotorNode Plus(const RotorNode& node, const RotorNodeError& error) {
  RotorError moving = RotorError::Zero();
  moving.head<kDriftError>() = error.head<kDriftError>();
  return {Plus(Joined(node.motion, RotorConstants::Zero()), moving).head<Model::kMoving>(),
          node.drift + error.tail<3>()};
}

RotorState Joined(const MovingState& motion, const RotorConstants& constants) {
  RotorState x;
  x << motion, constants;
  return x;
}

void Serialize(YamlArchive* a, RotorNoise* noise) {
  a->Positive("sigma_accel", &noise->accel);
  a->Positive("sigma_gyro", &noise->gyro);
  a->Positive("sigma_position", &noise->position);
  a->Positive("sigma_attitude", &noise->attitude);
  a->Positive("force_density", &noise->force_density);
  a->Positive("angular_density", &noise->angular_density);
  a->NotNegative("angular_drift", &noise->angular_drift);
  a->Positive("angular_drift_time", &noise->angular_drift_time);
}

}  // namespace trueline
