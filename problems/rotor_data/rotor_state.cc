#include "problems/rotor_data/rotor_state.h"

#include <cmath>

namespace trueline {
namespace {

using Model = RotorAeroModel;

std::vector<RotorConstantInfo> MakeNames() {
  std::vector<RotorConstantInfo> names = {{"m", "kg"}};
  const auto add = [&](const std::string& name, const std::string& unit) {
    for (const char* axis : {"x", "y", "z"}) names.push_back({name + axis, unit});
  };
  add("I_", "kg m^2"), add("r_BM_", "m"), add("r_BP_", "m"), add("r_BI_", "m");
  add("b_a_", "m/s^2"), add("b_w_", "rad/s");
  names.push_back({"k_f", "1"});
  names.push_back({"k_m", "1"});
  add("K_", "1/s");
  names.push_back({"inflow", "1"});
  names.push_back({"pose_delay", "s"});
  names.push_back({"motor_lag", "s"});
  names.push_back({"motor_idle", "1"});
  names.push_back({"motor_voltage", "1"});
  return names;
}

}  // namespace

const std::vector<RotorConstantInfo>& RotorConstantNames() {
  static const std::vector<RotorConstantInfo> names = MakeNames();
  return names;
}

int FindRotorConstant(const std::string& name) {
  const auto& all = RotorConstantNames();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

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

RotorState Joined(const RotorNode& moving, const RotorConstants& constants) {
  RotorState x;
  x << moving, constants;
  return x;
}

}  // namespace trueline
