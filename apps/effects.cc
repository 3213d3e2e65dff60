// trueline-effects: the effects that a diagnosis can name, with their definitions.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gflags/gflags.h>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/effects/declaration.h"

DEFINE_string(drive, "", "imu or rotors: only the effects which that model sees; all by default");
DEFINE_string(id, "", "only these effects, separated by commas");

namespace {

using trueline::DriveKind;
using trueline::EffectInfo;

constexpr char kUsage[] =
    R"(Lists the effects that a diagnosis can name: parameters, units, definition, physics.

  trueline-effects                  all of them
  trueline-effects --drive=rotors   those of rotor-driven vehicles
  trueline-effects --id=wind,gate_moved

The same ids and parameters stand in diagnosis.yaml, in model.yaml (key 'effects'), and in the
configuration of a simulated flight:

  effects:
    - {id: wind, w_x: 1.5, w_y: -1.0}

f_B is specific force in body axes, v_B velocity through the air in body axes, w the body's rate,
T the specific thrust, E the earth frame (north, east, down), E' that of the attitude filter.

Exit codes: 0 done, 2 bad input or usage.)";

template <class Parameter>
std::string WithUnit(const Parameter& parameter) {
  return fmt::format("{} [{}]", parameter.name, parameter.unit);
}

void Print(const EffectInfo& info) {
  std::vector<std::string> parameters;
  for (const auto& index : info.indices) parameters.push_back(WithUnit(index));
  for (const auto& parameter : info.parameters) parameters.push_back(WithUnit(parameter));
  fmt::print("{}: {}\n  {}\n  defined as: {}\n  acts on: {}\n  shown by: {}\n\n", info.id,
             fmt::join(parameters, ", "), info.physics, info.definition, NameOf(info.enters),
             info.separate_by);
}

void PrintDrive(DriveKind drive, const char* title) {
  fmt::print("{}\n\n", title);
  for (const EffectInfo* info : trueline::CausesOf(drive)) Print(*info);
}

void PrintNamed(const std::string& id) {
  const EffectInfo* info = trueline::FindDeclared(id);
  if (info == nullptr) {
    throw trueline::InputError(fmt::format("'{}' is no effect; `trueline effects` lists them", id));
  }
  Print(*info);
}

int Run() {
  if (!FLAGS_drive.empty() && FLAGS_drive != "imu" && FLAGS_drive != "rotors") {
    throw trueline::InputError(fmt::format("--drive: '{}' is neither imu nor rotors", FLAGS_drive));
  }
  if (!FLAGS_id.empty()) {
    for (const std::string& id : trueline::SplitList(FLAGS_id)) PrintNamed(id);
    return trueline::kExitDone;
  }
  if (FLAGS_drive != "rotors") PrintDrive(DriveKind::kImu, "Seen by the model that the IMU drives");
  if (FLAGS_drive != "imu")
    PrintDrive(DriveKind::kRotors, "Seen by the model that rotor speeds drive");
  return trueline::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  return trueline::RunApp("trueline-effects", kUsage, &argc, &argv, Run);
}
