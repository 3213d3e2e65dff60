// trueline-effects: the effects that a diagnosis can name, with their definitions.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/effects/declaration.h"
#include "problems/result/yaml_text.h"

DEFINE_string(drive, "", "imu or rotors: only the effects that this model sees; all by default");
DEFINE_string(id, "", "only these effects, separated by commas");
DEFINE_bool(yaml, false, "as YAML, for programs; with the sizes that the blind sets hide");

namespace {

using trueline::DriveKind;
using trueline::EffectInfo;

constexpr char kUsage[] =
    R"(Lists the effects that a diagnosis can name: parameters, units, definition, physics.

  trueline effects                  all of them
  trueline effects --drive=rotors   those of rotor-driven vehicles
  trueline effects --id=wind,gate_moved
  trueline effects --yaml           the same for a program

The same ids and parameters stand in diagnosis.yaml, in model.yaml (key 'effects'), and in the
configuration of a simulated flight:

  effects:
    - {id: wind, w_x: 1.5, w_y: -1.0}

f_B is specific force in body axes, v_B velocity through the air in body axes, w the body's rate,
T the specific thrust, E the earth frame (north, east, down), E' that of the attitude filter.

Exit codes: 0 done, 2 bad input or usage.)";

// The open catalogue has no list: a diagnosis forms its terms.
constexpr char kTerm[] =
    R"(term: where, with, size [unit of where over with]
  something that no other effect describes
  defined as: size times the product `with` is added to `where`: a force_x, moment_y,
    attitude_roll, accel_y, fix_z, ...; `with` is of named quantities such as q, v_x*T, sin(2*psi)
    or place(8.0,2.0;2.5)
)";

bool AsksForTerm() {
  const std::vector<std::string> ids = trueline::SplitList(FLAGS_id);
  return ids.empty() || std::find(ids.begin(), ids.end(), "term") != ids.end();
}

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

template <class Parameters>
void AddUnits(const Parameters& parameters, YAML::Node* node) {
  for (const auto& parameter : parameters) (*node)["parameters"][parameter.name] = parameter.unit;
}

YAML::Node ToYaml(const EffectInfo& info) {
  YAML::Node node;
  node["id"] = info.id;
  AddUnits(info.indices, &node);
  AddUnits(info.parameters, &node);
  node["physics"] = info.physics;
  node["definition"] = info.definition;
  node["acts_on"] = NameOf(info.enters);
  node["shown_by"] = info.separate_by;
  for (const trueline::DrawnSize& size : info.drawn) {
    YAML::Node range;
    range["low"] = trueline::Rounded(size.low, 6);
    range["high"] = trueline::Rounded(size.high, 6);
    range["either_sign"] = size.either_sign;
    range.SetStyle(YAML::EmitterStyle::Flow);
    node["drawn"][size.name] = range;
  }
  return node;
}

std::vector<const EffectInfo*> Asked() {
  std::vector<const EffectInfo*> asked;
  for (const std::string& id : trueline::SplitList(FLAGS_id)) {
    if (id == "term") continue;
    asked.push_back(trueline::FindDeclared(id));
    if (asked.back() != nullptr) continue;
    throw trueline::InputError(fmt::format("'{}' is no effect; `trueline effects` lists them", id));
  }
  if (!FLAGS_id.empty()) return asked;
  for (const DriveKind drive : {DriveKind::kImu, DriveKind::kRotors}) {
    if (FLAGS_drive == (drive == DriveKind::kImu ? "rotors" : "imu")) continue;
    const auto causes = trueline::CausesOf(drive);
    asked.insert(asked.end(), causes.begin(), causes.end());
  }
  return asked;
}

void PrintText(const std::vector<const EffectInfo*>& asked) {
  const EffectInfo* imu_first = trueline::CausesOf(DriveKind::kImu).front();
  const EffectInfo* rotors_first = trueline::CausesOf(DriveKind::kRotors).front();
  for (const EffectInfo* info : asked) {
    if (FLAGS_id.empty() && info == imu_first) {
      fmt::print("Seen by the model that the IMU drives\n\n");
    }
    if (FLAGS_id.empty() && info == rotors_first) {
      fmt::print("Seen by the model that rotor speeds drive\n\n");
    }
    Print(*info);
  }
  if (AsksForTerm()) fmt::print("{}", kTerm);
}

int Run() {
  if (!FLAGS_drive.empty() && FLAGS_drive != "imu" && FLAGS_drive != "rotors") {
    throw trueline::InputError(fmt::format("--drive: '{}' is neither imu nor rotors", FLAGS_drive));
  }
  const std::vector<const EffectInfo*> asked = Asked();
  if (!FLAGS_yaml) {
    PrintText(asked);
    return trueline::kExitDone;
  }
  YAML::Node all(YAML::NodeType::Sequence);
  for (const EffectInfo* info : asked) all.push_back(ToYaml(*info));
  fmt::print("{}", trueline::TextOf(all));
  return trueline::kExitDone;
}

}  // namespace

TRUELINE_VERB("effects", kUsage, Run);
