#include "problems/simulators/export_vehicle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/result/yaml_text.h"
#include "problems/simulators/audit.h"
#include "problems/simulators/vehicle_replay.h"

namespace trueline {
namespace {

constexpr double kUnknownLag = 0.02;  // s, of rotors whose lag the model does not state
constexpr double kFullSpeed = 2.0;    // of the speed in hover, likewise

// Rotors in the order that the simulator fixes: each of its places takes the nearest of the model's
// in direction. Throws InputError where the numbers of rotors differ.
std::vector<Numbers> InOrder(const NeutralVehicle& v, const Target& target) {
  if (target.order.empty()) return v.rotors;
  if (v.rotors.size() != target.order.size()) {
    throw InputError(
        fmt::format("--to={}: the simulator has {} rotors, the model {}; use rotorpy "
                    "or gz, which take any number",
                    target.name, target.order.size(), v.rotors.size()));
  }
  std::vector<Numbers> ordered;
  for (const FixedRotor& place : target.order) {
    const auto matches = [&](std::size_t i) {
      const int rotor = static_cast<int>(i);
      return place.x * v.Get("x_M", rotor) + place.y * v.Get("y_M", rotor);
    };
    std::size_t best = 0;
    for (std::size_t i = 1; i < v.rotors.size(); ++i) {
      if (matches(i) > matches(best)) best = i;
    }
    if (std::ranges::find(ordered, v.rotors[best]) != ordered.end()) {
      throw InputError(fmt::format(
          "--to={}: needs a rotor in each quarter (front right, rear left, ...); turn the model's "
          "body axes, or use rotorpy or gz",
          target.name));
    }
    ordered.push_back(v.rotors[best]);
  }
  return ordered;
}

// What stands for a parameter that the target lacks: drag by rotor speed for linear drag, and the
// other way round, which are equal in hover; quadratic drag that is as large at kCostSpeed.
void Express(const Target& target, NeutralVehicle* v) {
  const auto move = [&](const std::string& from, const std::string& to, double factor) {
    if (!v->States(from) || target.Has(from) || !target.Has(to)) return false;
    v->body[to] += factor * v->Get(from);
    return true;
  };
  const double sum = v->Get("S_h");
  if (target.Has("rotor_speed_drag") && !target.Has("K_x")) {
    v->body["rotor_speed_drag"] -= v->Get("K") / sum;
  }
  move("K_z", "rotor_inflow", -1.0 / sum);
  move("rotor_inflow", "K_z", -sum);
  if (move("rotor_speed_drag", "K_x", -sum)) v->body["K_y"] -= sum * v->Get("rotor_speed_drag");
  if (!target.Has("rotor_speed_drag") && target.Has("c_x")) {
    for (const char axis : {'x', 'y', 'z'}) {
      move(std::string("K_") + axis, std::string("c_") + axis, -1.0 / kCostSpeed);
    }
  }
}

// The skeleton with the lines between the marks "each rotor" and "end of rotors" once for each.
std::string ForRotors(const std::string& skeleton, std::size_t rotors) {
  std::string text;
  std::size_t at = 0;
  for (;;) {
    const std::size_t mark = skeleton.find("each rotor", at);
    if (mark == std::string::npos) return text + skeleton.substr(at);
    const std::size_t start = skeleton.rfind('\n', mark) + 1;
    const std::size_t body = skeleton.find('\n', mark) + 1;
    const std::size_t end = skeleton.rfind('\n', skeleton.find("end of rotors", body)) + 1;
    text += skeleton.substr(at, start - at);
    for (std::size_t i = 0; i < rotors; ++i) {
      std::string block = skeleton.substr(body, end - body);
      for (const auto& [name, number] : {std::pair{"{i}", i}, {"{r}", i + 1}}) {
        for (std::size_t p; (p = block.find(name)) != std::string::npos;) {
          block.replace(p, 3, std::to_string(number));
        }
      }
      // A list on one line: its last comma is left to the format, which allows it.
      text += block;
    }
    at = skeleton.find('\n', end) + 1;
  }
}

std::string Comment(const NeutralVehicle& model) {
  return fmt::format("Made by trueline-export {} of {}", Version(), model.name);
}

std::string TextOf(const std::string& skeleton, std::size_t rotors, const NeutralVehicle& model) {
  std::string text =
      ForRotors(ParameterFile::Read(FindShared("config/export/" + skeleton)).text(), rotors);
  constexpr char kHeader[] = "Skeleton of trueline-export";
  const std::size_t at = text.find(kHeader);
  return at == std::string::npos ? text : text.replace(at, sizeof(kHeader) - 1, Comment(model));
}

bool IsDrag(const std::string& name) {
  return name.starts_with("K_") || name.starts_with("c_") || name == "rotor_speed_drag" ||
         name == "rotor_inflow";
}

// m, that the vehicle flies apart with `name` as the file has it. All drag goes together, because
// one law of it stands for another.
std::optional<double> CostOf(const std::string& name, const Export& result) {
  NeutralVehicle changed = result.vehicle;
  const bool of_rotors = name == "k_f" || name == "k_m";
  for (std::size_t i = 0; of_rotors && i < changed.rotors.size(); ++i) {
    changed.rotors[i][name] = result.read.Get(name, static_cast<int>(i));
  }
  for (const NeutralInfo& info : kNeutral) {
    const std::string other = info.name;
    const bool goes_along = other == name || (IsDrag(name) && IsDrag(other));
    if (!of_rotors && goes_along) changed.body[other] = result.read.Get(other);
  }
  const double cost = Apart(result.vehicle, changed, kCostSpeed, kCostSeconds);
  return std::isfinite(cost) ? std::optional(cost) : std::nullopt;
}

bool SameInFile(const std::string& name, const Export& result) {
  constexpr double kSame = 0.005;  // relative
  const auto same = [&](int rotor) {
    const double model = result.vehicle.Get(name, rotor);
    return std::abs(model - result.read.Get(name, rotor)) <= kSame * std::abs(model);
  };
  if (name.starts_with("r_BM")) {
    constexpr double kNear = 0.002;  // of the arm
    const int axis = name.back() - 'x';
    return std::abs(result.vehicle.CentreFromRotors(axis) - result.read.CentreFromRotors(axis)) <=
           kNear * result.vehicle.Get("arm");
  }
  if (name != "k_f" && name != "k_m") return same(-1);
  for (int i = 0; i < static_cast<int>(result.vehicle.rotors.size()); ++i) {
    if (!same(i)) return false;
  }
  return true;
}

// The parameters that are not in the file as the model has them.
void AddLosses(const Target& target, Export* result) {
  const NeutralVehicle& model = result->vehicle;
  for (const NeutralInfo& info : kNeutral) {
    const std::string name = info.name;
    const bool stated = name == "k_f" || name == "k_m" || model.States(name);
    if (!stated || SameInFile(name, *result)) continue;
    std::string text = info.meaning;
    if (name.starts_with("r_BM")) text += "; the simulator has it in the middle of its rotors";
    for (const char* other : {"rotor_speed_drag", "rotor_inflow", "c_x", "K_x", "K_z"}) {
      if (!IsDrag(name) || model.States(other) || result->read.Get(other) == 0.0) continue;
      text += fmt::format("; {} {:.3g} stands for it", other, result->read.Get(other));
    }
    result->lost.push_back(
        {name, info.unit, model.Get(name), result->read.Get(name), CostOf(name, *result), text});
  }
  for (const auto& [name, value] : model.body) {
    if (!name.starts_with("effect ")) continue;
    result->lost.push_back({name.substr(7), "", value, 0.0, {}, "an effect of the model"});
  }
  for (std::size_t i = 0; i < target.order.size() && !target.Has("spin"); ++i) {
    const double spin = model.rotors[i].at("spin");
    if (spin == target.order[i].spin) continue;
    result->lost.push_back({fmt::format("spin of rotor {}", i),
                            "1",
                            spin,
                            static_cast<double>(target.order[i].spin),
                            {},
                            "the simulator's rotor turns the other way: yaw is mirrored"});
  }
}

// Commands of thrust have no rotor speeds: `v` as rotors of this speed at full command fly it.
void CountInSpeedsOf(double full_speed, NeutralVehicle* v) {
  const double ratio = v->Get("full_speed") / full_speed;
  for (Numbers& rotor : v->rotors) rotor["k_f"] *= ratio * ratio, rotor["k_m"] *= ratio * ratio;
  v->body["full_speed"] = full_speed;
}

}  // namespace

Export ExportVehicle(const NeutralVehicle& model, const Target& target) {
  Export result;
  result.vehicle = model;
  result.vehicle.rotors = InOrder(model, target);
  NeutralVehicle written = result.vehicle;
  written.gravity = target.gravity;
  for (const auto& [name, value] :
       {std::pair{"full_speed", kFullSpeed * written.Get("w_h")}, {"tau", kUnknownLag}}) {
    const bool needed = target.Has(name) || (target.by_thrust && name[0] == 'f');
    if (written.States(name) || !needed) continue;
    written.body[name] = value;
    result.assumed.push_back(fmt::format(
        "{} {:.3g} {} is assumed: a model of rotor speeds does not state it; calibrate with motor "
        "commands, or set it",
        name, value, FindNeutral(name)->unit));
  }
  Express(target, &written);

  std::vector<ParameterFile> files;
  for (const std::string& skeleton : target.skeletons) {
    files.push_back(ParameterFile::Parse(skeleton, TextOf(skeleton, written.rotors.size(), model)));
  }
  // Twice: what is left of the mass for the heaviest link depends on the other links.
  for (int pass = 0; pass < 2; ++pass) {
    const VehicleFile skeleton = ReadVehicleTexts(target, files);
    const std::vector<std::string> texts = WrittenFor(skeleton, written);
    files.clear();
    for (std::size_t i = 0; i < texts.size(); ++i) {
      files.push_back(ParameterFile::Parse(target.skeletons[i], texts[i]));
    }
  }
  result.read = ReadVehicleTexts(target, files).vehicle;
  for (std::size_t i = 0; i < files.size(); ++i) {
    result.files.push_back(
        {std::filesystem::path(target.skeletons[i]).extension().string(), files[i].text()});
  }
  result.read.gravity = model.gravity;
  if (!model.States("tau")) result.read.body.erase("tau");
  if (target.by_thrust) CountInSpeedsOf(written.Get("full_speed"), &result.read);
  AddLosses(target, &result);
  result.cost = Apart(result.vehicle, result.read, kCostSpeed, kCostSeconds);
  return result;
}

void WriteExport(const Export& exported, const Target& target, const std::filesystem::path& out) {
  for (std::size_t i = 0; i < exported.files.size(); ++i) {
    std::filesystem::path path = out;
    if (i > 0) path.replace_extension(exported.files[i].extension);
    if (i > 0 && path == out) path += exported.files[i].extension;
    WriteFileAtomically(path, exported.files[i].text);
  }
  YAML::Node node;
  node["target"] = target.name;
  node["lost"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Loss& loss : exported.lost) {
    YAML::Node entry = FlowMap({{"parameter", loss.name},
                                {"model", Rounded(loss.model, 4)},
                                {"file", Rounded(loss.file, 4)},
                                {"unit", loss.unit}});
    if (loss.cost) entry["cost"] = YAML::Load(Rounded(*loss.cost, 3));
    entry["text"] = loss.text;
    node["lost"].push_back(entry);
  }
  node["cost"] = FlowMap(
      {{"all", std::isfinite(exported.cost) ? Rounded(exported.cost, 3) : std::string("diverges")},
       {"unit", "m"},
       {"after", Rounded(kCostSeconds, 3)},
       {"speed", Rounded(kCostSpeed, 3)}});
  node["assumed"] = exported.assumed;
  node["equations"] = target.caveat;
  WriteFileAtomically(out.string() + ".lost.yaml", TextOf(node));
}

std::string LossText(const Export& exported, const Target& target) {
  std::string text;
  for (const Loss& loss : exported.lost) {
    text += fmt::format("not as in the model: {} ({}): {:.4g} {}, the file has {:.4g}{}\n",
                        loss.name, loss.text, loss.model, loss.unit, loss.file,
                        loss.cost ? fmt::format("; costs {:.3f} m", *loss.cost) : "");
  }
  for (const std::string& assumed : exported.assumed) text += assumed + "\n";
  if (!target.caveat.empty()) text += fmt::format("{}: {}\n", target.name, target.caveat);
  return text + fmt::format("position error of the file after {} s at {} m/s: {}\n", kCostSeconds,
                            kCostSpeed, ErrorInWords(exported.cost));
}

}  // namespace trueline
