#include "problems/simulators/audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"
#include "problems/simulators/judge_flights.h"

namespace trueline {
namespace {

// m, where what the term is wrong by acts all the time.
ErrorByHorizon CostOfTerm(const FlightValue& flight, double simulated) {
  const double off = std::abs(simulated - flight.value) * flight.size;
  ErrorByHorizon cost{};
  for (std::size_t k = 0; k < cost.size(); ++k) {
    const double t = kHorizons[k];
    cost[k] = flight.moment ? 9.81 * off * std::pow(t, 4) / 24.0 : 0.5 * off * t * t;
  }
  return cost;
}

// Logs show k_m / I_z: of a quadrotor's usual I_z beside I_x and I_y.
void TakeUsualYaw(double held, std::map<std::string, FlightValue>* values) {
  const FlightValue &x = (*values)["I_x"], &y = (*values)["I_y"];
  FlightValue& moment = (*values)["k_m/k_f"];
  if (!x.shown || !y.shown) return;
  ScaleValues({"k_m/k_f"}, kUsualYawInertia * (x.value + y.value) / held, values);
  moment.sigma = std::hypot(moment.sigma, kShapeSigma * moment.value);
}

// A heavier vehicle's rotors turn faster, by the root of its mass, and a force moves it less. True
// for drag and damping that differ only by that: rotors' drag, the body's, rotors' damping.
bool FollowsFromMass(const FlightJudge& judge, const std::string& name, double simulated,
                     double heavier, const FlightValue& flight) {
  if (std::string("KLMN").find(name[0]) == std::string::npos) return false;
  const double faster = std::sqrt(heavier);
  return std::ranges::any_of(std::array{faster, heavier, 1.0 / faster}, [&](double by) {
    return !judge.Differs(name, by * simulated, flight);
  });
}

// What the descriptions of two logs state of the rotors; `flown` gets the simulator's.
void CompareStated(const FlightLog& simulated, const FlightLog& log, NeutralVehicle* flown,
                   Audit* audit) {
  if (!StatesRotors(simulated, *flown) || !StatesRotors(log, *flown)) return;
  CompareSpins(nullptr, simulated, LogOrder(*flown, simulated), flown, audit);
  const double arm = ArmOfRotors(simulated.vehicle->rotors);
  if (CompareWithLog("arm", arm, ArmOfRotors(log.vehicle->rotors), "the places of the rotors",
                     audit)) {
    *flown = With(*flown, "arm", arm);
  }
}

// A ratio that a mistake of units makes.
struct UnitFactor {
  double factor;
  const char* text;
};
constexpr UnitFactor kUnitFactors[] = {
    {91.189, "rpm for rad/s, squared"},
    {9.5493, "rpm for rad/s"},
    {39.478, "revolutions for radians, squared"},
    {6.2832, "revolutions for radians"},
    {57.296, "degrees for radians"},
    {9.81, "kgf for N"},
    {10.0, "a power of ten"},
    {100.0, "a power of ten"},
    {1000.0, "a power of ten"},
    {2.0, "a factor of two"},
};
constexpr double kFactorSlack = 0.02;  // relative

// "diverges" for a number that is infinite; nothing where the flight is too short for the horizon.
YAML::Node ErrorsNode(const ErrorByHorizon& errors) {
  constexpr const char* kKeys[] = {"0.25", "0.5", "1.0"};
  YAML::Node node;
  node.SetStyle(YAML::EmitterStyle::Flow);
  for (std::size_t k = 0; k < errors.size(); ++k) {
    if (std::isnan(errors[k])) continue;
    node[kKeys[k]] =
        std::isfinite(errors[k]) ? YAML::Load(Rounded(errors[k], 4)) : YAML::Node("diverges");
  }
  node["unit"] = "m";
  return node;
}

// A node for each entry.
template <class Entry>
YAML::Node ListOf(const std::vector<Entry>& entries, const auto& node_of) {
  YAML::Node list(YAML::NodeType::Sequence);
  for (const Entry& entry : entries) list.push_back(node_of(entry));
  return list;
}

YAML::Node ContradictedNode(const Contradicted& c) {
  YAML::Node node;
  node["parameter"] = c.parameter;
  node["file_value"] = YAML::Load(Rounded(c.file_value, 6));
  if (c.flight_value) {
    node["flight_value"] = YAML::Load(Rounded(*c.flight_value, 6));
    node["sigma"] = YAML::Load(Rounded(c.sigma, 3));
  }
  node["unit"] = c.unit;
  if (c.cost) node["cost"] = ErrorsNode(*c.cost);
  if (!c.confused_with.empty()) node["confused_with"] = c.confused_with;
  node["text"] = c.text;
  if (!c.file.empty()) {
    node["place"] =
        FlowMap({{"file", c.file}, {"line", fmt::format("{}", c.line)}, {"key", c.key}});
  }
  return node;
}

}  // namespace

Audit AuditFiles(const std::vector<VehicleFile>& files) {
  Audit audit;
  const auto add = [&](const std::vector<Contradicted>& more) {
    audit.contradicted.insert(audit.contradicted.end(), more.begin(), more.end());
  };
  for (const VehicleFile& file : files) {
    audit.simulator += (audit.simulator.empty() ? "" : "; ") + file.Name();
    add(CheckVehicle(file));
    if (file.vehicle.Flies() || NotPositive(file)) continue;
    audit.warnings.push_back(fmt::format(
        "{} states no whole vehicle ({}); what depends on the rest is not checked: give its other "
        "files, too, after commas",
        file.Name(), file.vehicle.rotors.empty() ? "no rotors" : "no mass, inertia or places"));
  }
  add(CompareVehicles(files));
  for (const NeutralInfo& info : kNeutral) {
    if (*info.fly == '\0' && info.needs == 0) continue;
    const bool stated = std::ranges::any_of(
        files, [&](const VehicleFile& file) { return file.Find(info.name) != nullptr; });
    if (stated) audit.not_judged.push_back(NotShown(info.name, {}));
  }
  JudgeOnce(&audit);
  return audit;
}

Audit AuditLogs(const FlightLog& simulated, const std::vector<FlightLog>& logs) {
  Audit audit;
  audit.simulator = simulated.directory;
  const bool states = logs.front().vehicle && !logs.front().vehicle->rotors.empty();
  NeutralVehicle start = VehicleOfLog(states ? logs.front() : simulated);
  const auto mass = [](const FlightLog& log) {
    return log.vehicle ? log.vehicle->mass : std::nullopt;
  };
  if (mass(logs.front())) start.body["m"] = *mass(logs.front());
  NeutralVehicle flown = start;
  CompareStated(simulated, logs.front(), &flown, &audit);
  if (mass(simulated)) flown.body["m"] = *mass(simulated);
  const bool weighed = mass(simulated) && mass(logs.front());
  if (weighed) CompareWithLog("m", flown.Get("m"), start.Get("m"), "the masses", &audit);
  std::vector<FlightEstimate> flights = Estimates(logs, start, &audit);
  // Both are fitted from one start: what differs is the simulator's.
  std::vector<FlightEstimate> in_simulator = Estimates({simulated}, flown, &audit);
  audit.logs.pop_back();
  std::map<std::string, FlightValue> values = Together(flights), simulator = Together(in_simulator);
  const FlightJudge judge{&audit, flights, start.Get("arm"), logs.front()};
  const double factor = judge.OneFactor(
      {"k_f"}, {"I_x", "I_y"}, [&](const std::string& name) { return simulator[name].value; },
      values);
  if (!weighed && factor != 1.0) {
    ScaleValues({"k_f", "I_x", "I_y"}, 1.0 / factor, &simulator),
        ScaleValues({"k_m/k_f"}, factor, &simulator);
    const double sigma = start.Get("m") * values["I_x"].sigma / values["I_x"].value;
    judge.Compare("m", flown.Get("m") / factor, {start.Get("m"), sigma, true}, nullptr, nullptr);
  }
  const double heavier = weighed ? flown.Get("m") / start.Get("m") : 1.0 / factor;
  TakeUsualYaw(start.Get("I_z"), &values), TakeUsualYaw(start.Get("I_z"), &simulator);
  bool turned = false;  // drag along other axes than the body's changes that along them, too
  for (const auto& [name, b] : values) {
    if (turned && name.starts_with("K_")) continue;
    const auto a = simulator.find(name);
    const bool fitted = b.size == 0.0 && (name == "L_v" || name == "M_u");  // beside others
    if (a == simulator.end() || name == "k_m" || fitted) continue;
    if (!a->second.shown || !b.shown) {
      if (b.size == 0.0) audit.not_judged.push_back(NotShown(name, logs.front()));
      continue;
    }
    const FlightValue both{b.value, std::hypot(a->second.sigma, b.sigma), true};
    // A simulator that knows nothing of an effect lacks it; its zero is no wrong number.
    const bool none = std::abs(a->second.value) < std::max(kThreshold * a->second.sigma,
                                                           Tolerance(name, 0.0, start.Get("arm")));
    const bool drag = name == "K_x" || name == "K_y" || name == "K_z";
    // Yaw that lags the speeds is an offset of the log's clocks.
    const bool late = name == "J_r_yaw" && a->second.value < 0.0;
    if (b.size > 0.0 && (none || late) && !drag) continue;
    if (Names(audit.contradicted, "m") &&
        FollowsFromMass(judge, name, a->second.value, heavier, both)) {
      continue;
    }
    if (!judge.Compare(name, a->second.value, both, nullptr, nullptr)) continue;
    if (name == "k_m/k_f") {
      audit.contradicted.back().confused_with = {"I_z"};
      audit.contradicted.back().text += "; or I_z by the inverse: a flight shows their ratio";
    }
    if (b.size == 0.0) continue;
    turned = turned || name == "K_twice";
    Contradicted& entry = audit.contradicted.back();
    entry.cost = CostOfTerm(b, a->second.value);
    entry.text += (entry.text.empty() ? "" : "; ") + std::string(FindNeutral(name)->meaning);
  }
  judge.AddCosts();
  audit.before = ProofOf(in_simulator.front().vehicle, flights, logs, audit);
  audit.after = audit.best;
  JudgeOnce(&audit);
  return audit;
}

std::string UnitOf(const std::string& parameter) {
  if (parameter == "k_m/k_f" || parameter == "arm") return "m";
  const NeutralInfo* info = FindNeutral(parameter);
  return info != nullptr ? info->unit : "";
}

std::string RatioInWords(double file, double flight) {
  if (!(file != 0.0 && flight != 0.0)) return "";
  if (file / flight < 0.0) return "the sign is the other one";
  const double ratio = std::max(file / flight, flight / file);
  std::string text = fmt::format("{:.3g} times too {}", ratio,
                                 std::abs(file) > std::abs(flight) ? "large" : "small");
  const UnitFactor* nearest = std::ranges::min_element(
      kUnitFactors, {}, [&](const UnitFactor& f) { return std::abs(ratio / f.factor - 1.0); });
  const bool near = std::abs(ratio / nearest->factor - 1.0) < kFactorSlack;
  return near ? text + fmt::format(": {}?", nearest->text) : text;
}

NotJudged NotShown(const std::string& parameter, const FlightLog& log) {
  if (parameter == "k_m/k_f") {
    return {parameter, "yaw hard to both sides and stop, several times"};
  }
  const NeutralInfo* info = FindNeutral(parameter);
  if (info == nullptr || (*info->fly == '\0' && info->needs == 0)) {
    return {parameter, "fly each axis hard, and hover"};
  }
  std::string text = info->fly;
  const auto add = [&](unsigned need, bool has, const char* advice) {
    if ((info->needs & need) == 0 || has) return;
    text += (text.empty() ? "" : "; ") + std::string(advice);
  };
  add(kNeedsSpeeds, !log.rotors.empty(), "log measured rotor speeds");
  add(kNeedsCommands, !log.motors.empty(), "log motor commands");
  add(kNeedsMass, log.vehicle && log.vehicle->mass, "state the weighed mass in the log");
  return {parameter, text.empty() ? "the flight leaves it uncertain" : text};
}

std::string ErrorInWords(double error) {
  if (std::isnan(error)) return "no prediction";
  return std::isfinite(error) ? fmt::format("{:.3f} m", error) : "diverges";
}

void AddLacks(const std::map<std::string, FlightValue>& values, bool has_drag, bool has_lag,
              Audit* audit) {
  constexpr double kMentionedDrag = 0.1;  // 1/s
  constexpr double kMentionedTurn = 3.0;  // rad/m/s
  const auto clear = [&](const char* name, double least) {
    const auto found = values.find(name);
    return found != values.end() && found->second.shown && std::abs(found->second.value) > least &&
           std::abs(found->second.value) > kThreshold * found->second.sigma;
  };
  if (!has_drag && (clear("K_x", kMentionedDrag) || clear("K_y", kMentionedDrag))) {
    audit->lacks.push_back(
        {"linear_drag", fmt::format("the vehicle brakes with K_x {:.2f}, K_y {:.2f} 1/s",
                                    values.at("K_x").value, values.at("K_y").value)});
  }
  if (clear("L_v", kMentionedTurn) || clear("M_u", kMentionedTurn)) {
    audit->lacks.push_back(
        {"air_moment", fmt::format("air speed turns the vehicle: L_v {:.1f}, M_u {:.1f} rad/m/s",
                                   values.at("L_v").value, values.at("M_u").value)});
  }
  if (!has_lag && clear("tau", 0.01)) {
    audit->lacks.push_back(
        {"motor_lag",
         fmt::format("the rotors follow their commands {:.3f} s late", values.at("tau").value)});
  }
}

void WriteAudit(const Audit& audit, const std::filesystem::path& directory) {
  YAML::Node node;
  node["simulator"] = audit.simulator;
  node["logs"] = audit.logs;
  node["contradicted"] = ListOf(audit.contradicted, ContradictedNode);
  node["not_judged"] = ListOf(audit.not_judged, [](const NotJudged& n) {
    return FlowMap({{"parameter", n.parameter}, {"fly", n.fly}});
  });
  node["lacks"] = ListOf(audit.lacks, [](const Lack& lack) {
    return FlowMap({{"effect", lack.effect}, {"text", lack.text}});
  });
  node["compared"] = ListOf(audit.compared, [](const Compared& c) {
    YAML::Node entry = FlowMap({{"parameter", c.parameter},
                                {"file_value", Rounded(c.file_value, 5)},
                                {"flight_value", Rounded(c.flight_value, 5)},
                                {"sigma", Rounded(c.sigma, 3)},
                                {"tolerance", Rounded(c.tolerance, 3)},
                                {"unit", c.unit},
                                {"contradicted", c.contradicted ? "true" : "false"}});
    if (c.cost) entry["cost"] = ErrorsNode(*c.cost);
    return entry;
  });
  if (audit.before) node["before"] = ErrorsNode(*audit.before);
  if (audit.after) node["after"] = ErrorsNode(*audit.after);
  if (audit.best) node["flight"] = ErrorsNode(*audit.best);
  node["warnings"] = audit.warnings;
  WriteFileAtomically(directory / "audit.yaml", TextOf(node));
  for (const auto& [name, text] : audit.corrected) WriteFileAtomically(directory / name, text);
}

std::string AuditTable(const Audit& audit) {
  std::string table;
  for (const Contradicted& c : audit.contradicted) {
    table += fmt::format("contradicted: {:<17} ", c.parameter);
    if (c.flight_value) {
      table += fmt::format("file {:.4g}, flight {:.4g} +- {:.2g} {}", c.file_value, *c.flight_value,
                           c.sigma, c.unit);
      if (c.cost && std::isinf((*c.cost)[1])) {
        table += "; with it a prediction diverges within 0.5 s";
      } else if (c.cost && std::isfinite((*c.cost)[1])) {
        table += fmt::format("; costs {:.3f} m in 0.5 s", (*c.cost)[1]);
      }
      if (!c.text.empty()) table += "; " + c.text;
    } else {
      table += fmt::format("file {:.4g} {}; {}", c.file_value, c.unit, c.text);
    }
    if (c.line > 0) table += fmt::format(" ({}:{})", c.file, c.line);
    table += "\n";
  }
  if (audit.contradicted.empty()) table += "nothing is contradicted\n";
  // A number stands in one list: what is shown roughly is undecided, with what would decide it.
  for (const Compared& c : audit.compared) {
    if (c.contradicted || Names(audit.contradicted, c.parameter)) continue;
    const auto rough = std::ranges::find(audit.not_judged, c.parameter, &NotJudged::parameter);
    const bool decided = rough == audit.not_judged.end();
    table += fmt::format("{:<13} {:<17} file {:.4g}, flight {:.4g} +- {:.2g} {}",
                         !decided ? "undecided:"
                         : c.cost ? "differs:"
                                  : "agrees:",
                         c.parameter, c.file_value, c.flight_value, c.sigma, c.unit);
    if (!decided) {
      table += "; " + rough->fly;
    } else if (c.cost) {
      table += fmt::format(", as vehicles of one kind do; costs {} in 0.5 s",
                           ErrorInWords((*c.cost)[1]));
    }
    table += "\n";
  }
  for (const Lack& lack : audit.lacks) {
    table += fmt::format("lacks:        {}: {}\n", lack.effect, lack.text);
  }
  for (const NotJudged& n : audit.not_judged) {
    if (Names(audit.compared, n.parameter)) continue;
    table += fmt::format("not judged:   {:<17} {}\n", n.parameter, n.fly);
  }
  if (audit.before && audit.after) {
    for (std::size_t k = 0; k < kHorizons.size(); ++k) {
      table += fmt::format(
          "held-out flight, {:.2f} s: {} with the file, {} corrected{}\n", kHorizons[k],
          ErrorInWords((*audit.before)[k]), ErrorInWords((*audit.after)[k]),
          audit.best ? ", " + ErrorInWords((*audit.best)[k]) + " as the flight fits it" : "");
    }
  }
  return table;
}

}  // namespace trueline
