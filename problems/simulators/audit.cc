#include "problems/simulators/audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "problems/simulators/describe_audit.h"
#include "problems/simulators/judge_flights.h"

namespace trueline {

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

}  // namespace

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

}  // namespace trueline
