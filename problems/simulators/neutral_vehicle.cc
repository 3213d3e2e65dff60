#include "problems/simulators/neutral_vehicle.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "problems/common/error.h"
#include "problems/effects/declaration.h"
#include "problems/log/log_yaml.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr const char* kCentre[] = {"r_BM_x", "r_BM_y", "r_BM_z"};
constexpr const char* kPlace[] = {"x", "y", "z"};

constexpr double kAtOnce = 1000.0;  // 1/s, rate of rotors whose lag is not known

double Lookup(const Numbers& numbers, const std::string& name) {
  const auto found = numbers.find(name);
  return found == numbers.end() ? 0.0 : found->second;
}

Eigen::Vector3d FromCentre(const NeutralVehicle& v, const Numbers& rotor) {
  Eigen::Vector3d place;
  for (int i = 0; i < 3; ++i) place[i] = Lookup(rotor, kPlace[i]) - Lookup(v.body, kCentre[i]);
  return place;
}

template <class Function>
double MeanOver(const NeutralVehicle& v, const Function& of) {
  double sum = 0.0;
  for (const Numbers& rotor : v.rotors) sum += of(rotor);
  return v.rotors.empty() ? 0.0 : sum / static_cast<double>(v.rotors.size());
}

// Effects and their parameters by the vehicle's names.
struct EffectName {
  const char *id, *parameter, *name;
};
constexpr EffectName kEffects[] = {
    {"linear_drag", "K_x", "K_x"},         {"linear_drag", "K_y", "K_y"},
    {"linear_drag", "K_z", "K_z"},         {"rotor_speed_drag", "k", "rotor_speed_drag"},
    {"rotor_inflow", "k", "rotor_inflow"}, {"translational_lift", "k", "translational_lift"},
    {"body_drag", "c_x", "c_x"},           {"body_drag", "c_y", "c_y"},
    {"body_drag", "c_z", "c_z"},           {"ground_effect", "k", "ground_effect"},
    {"air_moment", "roll", "air_moment"},  {"air_moment", "pitch", "air_moment"},
    {"motor_lag", "tau", "tau"},
};

}  // namespace

const NeutralInfo* FindNeutral(const std::string& name) {
  for (const NeutralInfo& info : kNeutral) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

double NeutralVehicle::InertiaOfMotors(int axis) const {
  double squares = 0.0;
  for (const Numbers& r : rotors) {
    const Eigen::Vector3d place = FromCentre(*this, r);
    squares += place.squaredNorm() - place[axis] * place[axis];
  }
  return Get("raw_motor_mass") * squares;
}

double NeutralVehicle::SideOfBox(int axis) const {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double moment = Get(std::string("I_") + "xyz"[k]) - InertiaOfMotors(k);
    sum += k == axis ? -moment : moment;
  }
  const double mass = Get("m") - Get("n") * Get("raw_motor_mass");
  return std::sqrt(std::max(0.0, 6.0 * sum / mass));
}

double NeutralVehicle::Get(const std::string& number, int rotor) const {
  if (rotor >= 0) {
    const Numbers& r = rotors.at(static_cast<std::size_t>(rotor));
    const Eigen::Vector3d place = FromCentre(*this, r);
    if (number == "x_M" || number == "y_M" || number == "z_M") return place[number[0] - 'x'];
    if (number == "radius") return place.head<2>().norm();
    if (number == "angle") return std::atan2(place.y(), place.x());
    if (number == "spin_k_m") return Lookup(r, "spin") * Lookup(r, "k_m");
    if (r.contains(number)) return r.at(number);
  }
  const auto mean_lever = [&](int axis) {
    return MeanOver(*this, [&](const Numbers& r) { return std::abs(FromCentre(*this, r)[axis]); });
  };
  if (number == "k_f" || number == "k_m") {
    return MeanOver(*this, [&](const Numbers& r) { return Lookup(r, number); });
  }
  if (number == "body_mass") return Get("m") - Get("n") * Get("raw_rotor_mass");
  if (number.starts_with("small_")) return 1.0;
  if (number == "n") return static_cast<double>(rotors.size());
  if (number == "g") return gravity;
  if (number == "w_h") return std::sqrt(Get("m") * gravity / (Get("n") * Get("k_f")));
  if (body.contains(number)) return body.at(number);
  if (number == "S_h") return Get("n") * Get("w_h");
  if (number.starts_with("box_")) return SideOfBox(number[4] - 'x');
  if (number == "rise") return Get("tau") > 0.0 ? 1.0 / Get("tau") : kAtOnce;
  if (number == "fall") {
    return States("tau_down") ? 1.0 / Get("tau_down") : Get("rise");
  }
  if (number == "tau_down") return Get("tau");
  if (number == "arm") {
    return MeanOver(*this, [&](const Numbers& r) { return FromCentre(*this, r).head<2>().norm(); });
  }
  if (number == "lever_x") return mean_lever(0);
  if (number == "lever_y") return mean_lever(1);
  if (number == "lever") return 0.5 * (mean_lever(0) + mean_lever(1));
  if (number == "K") return (Get("K_x") + Get("K_y")) / 2.0;
  if (number == "c") return (Get("c_x") + Get("c_y")) / 2.0;
  return 0.0;
}

void NeutralVehicle::Set(const std::string& number, int rotor, double value) {
  constexpr std::string_view kOfRotor[] = {"x",   "y",   "z",      "x_M",   "y_M",      "z_M",
                                           "k_f", "k_m", "radius", "angle", "spin_k_m", "spin"};
  if (number.starts_with("small_")) return;
  if (rotor >= 0 && std::ranges::find(kOfRotor, number) != std::end(kOfRotor)) {
    Numbers& r = rotors.at(static_cast<std::size_t>(rotor));
    if (number.ends_with("_M")) {
      const int axis = number[0] - 'x';
      r[kPlace[axis]] = value + Lookup(body, kCentre[axis]);
    } else if (number == "spin_k_m") {
      r["spin"] = value < 0.0 ? -1.0 : 1.0;
      r["k_m"] = std::abs(value);
    } else {
      r[number] = value;
    }
    return;
  }
  if (number == "k_f" || number == "k_m") {
    for (Numbers& r : rotors) r[number] = value;
  } else if (number == "K") {
    for (const char* axis : {"K_x", "K_y", "K_z"}) body[axis] = value;
  } else if (number == "c") {
    for (const char* axis : {"c_x", "c_y", "c_z"}) body[axis] = value;
  } else if (number == "body_mass") {
    body["m"] = value + Get("n") * Get("raw_rotor_mass");
  } else {
    body[number] = value;
  }
}

double NeutralVehicle::CentreFromRotors(int axis) const {
  return -MeanOver(*this, [&](const Numbers& r) { return FromCentre(*this, r)[axis]; });
}

bool NeutralVehicle::Flies() const {
  for (const char* number : {"m", "I_x", "I_y", "I_z"}) {
    if (!(Get(number) > 0.0)) return false;
  }
  for (const Numbers& r : rotors) {
    if (!r.contains("x") || !r.contains("y") || !r.contains("spin") || !(Lookup(r, "k_f") > 0.0)) {
      return false;
    }
  }
  return rotors.size() >= 3;
}

RotorModelFile ReadRotorModel(const std::string& file) {
  const YamlMap model = YamlMap::FromFile(file);
  const YamlMap parameters = model.Child("parameters");
  const YAML::Node config = model.Child("provenance").RawNode("config");
  if (!config || !config.IsMap() || !config["rotors"]) {
    throw ErrorAt(file, model.LineOf("provenance"),
                  "'provenance' names no rotors; give the model.yaml of trueline calibrate or "
                  "trueline diagnose with --drive=rotors");
  }
  RotorModelFile read;
  const YAML::Node prior = config["prior"];
  for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
    const char* name = kRotorConstants[i].name;
    if (prior && prior[name]) read.constants[i] = prior[name]["mean"].as<double>();
    if (parameters.Has(name)) read.constants[i] = parameters.Child(name).Get<double>("value");
  }
  const YamlMap rotors(config, file, "provenance.config");
  read.rotors = ReadRotors(rotors.Children("rotors"));
  if (config["motors"]) read.full_speed = config["motors"]["full_speed"].as<double>();
  read.effects = ReadEffects(model, DriveKind::kRotors);
  return read;
}

NeutralVehicle VehicleFromModel(const std::string& file) {
  const RotorModelFile model = ReadRotorModel(file);
  const auto of = [&](const char* name) { return model.constants[FindRotorConstant(name)]; };

  NeutralVehicle v;
  v.name = std::filesystem::path(file).stem().string();
  for (const char* name : {"m", "I_x", "I_y", "I_z", "r_BM_x", "r_BM_y", "r_BM_z"}) {
    v.body[name] = of(name);
  }
  for (const Rotor& rotor : model.rotors) {
    v.rotors.push_back({{"x", rotor.position.x()},
                        {"y", rotor.position.y()},
                        {"z", rotor.position.z()},
                        {"spin", rotor.spin},
                        {"k_f", of("k_f") * rotor.k_f},
                        {"k_m", of("k_m") * rotor.k_m}});
  }
  const auto add = [&](const std::string& number, double value) {
    if (value != 0.0) v.body[number] += value;
  };
  for (const char* name : {"K_x", "K_y", "K_z"}) add(name, of(name));
  add("rotor_inflow", of("inflow"));
  add("air_moment", 0.5 * (v.Get("I_y") * of("M_u") - v.Get("I_x") * of("L_v")));
  if (model.full_speed > 0.0) {
    v.body["full_speed"] = model.full_speed;
    v.body["idle_speed"] = v.body["full_speed"] * of("motor_idle");
    add("tau", of("motor_lag"));
  }
  for (const Effect& effect : model.effects) {
    if (effect.id == "air_moment") {
      add("air_moment", 0.5 * (effect["roll"] + effect["pitch"]));
      continue;
    }
    if (effect.id == "rotor_loss") {
      const auto rotor = static_cast<std::size_t>(effect["rotor"]);
      if (rotor < v.rotors.size()) v.rotors[rotor]["k_f"] *= effect["factor"];
      continue;
    }
    bool known = false;
    for (const EffectName& entry : kEffects) {
      if (effect.id != entry.id) continue;
      add(entry.name, effect[entry.parameter]);
      known = true;
    }
    // What no simulator has (a wind, a sag, a step, a term): its id, for the list of what is lost.
    if (!known) v.body["effect " + InWords(effect)] = 1.0;
  }
  if (!v.Flies()) {
    throw ErrorAt(file, 0, "states no mass, inertia and rotors with k_f; calibrate the vehicle");
  }
  return v;
}

std::vector<Effect> EffectsOf(const NeutralVehicle& vehicle) {
  std::map<std::string, Effect> effects;
  for (const EffectName& name : kEffects) {
    const double value = vehicle.Get(name.name);
    if (value == 0.0 || std::string(name.id) == "motor_lag") continue;
    effects[name.id].id = name.id;
    effects[name.id].values[name.parameter] = value;
  }
  std::vector<Effect> list;
  for (const auto& [id, effect] : effects) list.push_back(effect);
  return list;
}

RotorVehicle RotorVehicleOf(const NeutralVehicle& vehicle) {
  using Driven = RotorDrivenModel;
  std::vector<Rotor> rotors;
  for (std::size_t i = 0; i < vehicle.rotors.size(); ++i) {
    const auto of = [&](const char* name) { return vehicle.Get(name, static_cast<int>(i)); };
    rotors.push_back({{of("x"), of("y"), of("z")},
                      {0.0, 0.0, -1.0},
                      of("spin") < 0.0 ? -1 : 1,
                      of("k_f"),
                      of("k_m")});
  }
  RotorVehicle result{Driven(rotors, vehicle.gravity), std::vector<double>(Driven::kStates, 0.0)};
  std::vector<double>& x = result.parameters;
  x[Driven::kAttitude] = x[Driven::kThrustScale] = x[Driven::kTorqueScale] = 1.0;
  x[Driven::kMass] = vehicle.Get("m");
  for (int i = 0; i < 3; ++i) {
    constexpr const char* kInertia[] = {"I_x", "I_y", "I_z"};
    x[Driven::kInertia + i] = vehicle.Get(kInertia[i]);
    x[Driven::kCentre + i] = vehicle.Get(kCentre[i]);
  }
  return result;
}

}  // namespace trueline
