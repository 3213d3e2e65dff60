#include "problems/simulators/judge_flights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/result/statistics.h"
#include "problems/simulators/flight_estimate.h"
#include "problems/simulators/vehicle_replay.h"

namespace trueline {
namespace {

// What vehicles of one kind, or one vehicle on two days, differ by: no simulator is wrong by that.
// A share of the value, and at least `floor` in the unit.
struct Scatter {
  const char* parameter;
  double share, floor;
};
constexpr Scatter kScatter[] = {
    {"m", 0.05, 0.0},        {"I_x", 0.15, 0.0},    {"I_y", 0.15, 0.0},
    {"I_z", 0.2, 0.0},       {"k_f", 0.06, 0.0},    {"k_m", 0.2, 0.0},
    {"k_m/k_f", 0.2, 0.0},   {"K_x", 0.4, 0.12},    {"K_y", 0.4, 0.12},
    {"K_z", 0.5, 0.2},       {"tau", 0.2, 0.003},   {"full_speed", 0.1, 0.0},
    {"arm", 0.05, 0.0},      {"K_xy", 0.0, 0.12},   {"K_yx", 0.0, 0.12},
    {"K_twice", 0.0, 0.12},  {"L_p", 0.5, 0.3},     {"M_q", 0.5, 0.3},
    {"N_r", 0.5, 0.3},       {"L_u", 0.5, 0.3},     {"L_v", 0.5, 0.3},
    {"M_u", 0.5, 0.3},       {"M_v", 0.5, 0.3},     {"J_r_roll", 0.5, 0.0},
    {"J_r_pitch", 0.5, 0.0}, {"J_r_yaw", 0.5, 0.0}, {"translational_lift", 0.5, 0.003},
};
constexpr double kCentreScatter = 0.06;  // of the arm, of the centre of mass

// m, that a lag costs: replays with speeds that are measured do not see it.
ErrorByHorizon CostOfLag(const NeutralVehicle& vehicle, double file, double flight) {
  NeutralVehicle with = vehicle, without = vehicle;
  with.body["tau"] = flight, without.body["tau"] = file;
  ErrorByHorizon cost{};
  for (std::size_t k = 0; k < cost.size(); ++k) {
    cost[k] = Apart(with, without, 0.0, kHorizons[k]);
  }
  return cost;
}

// Two readings of one flight: the mixture of both, which is no more certain where they differ.
void Mix(const FlightValue& other, FlightValue* value) {
  const double a = value->sigma * value->sigma, b = other.sigma * other.sigma;
  const double share = a / (a + b), apart = other.value - value->value;
  value->value += share * apart;
  value->sigma = std::sqrt((1.0 - share) * a + share * b + share * (1.0 - share) * apart * apart);
}

// Adds what the flight shows term by term. The fit shows thrust and drag, too.
void AddTerms(const FlightLog& log, FlightEstimate* flight) {
  for (const auto& [name, term] : TermsOf(log, *flight)) {
    FlightValue& value = flight->values[name];
    if (value.shown && (name[0] == 'K' || name == "k_f")) {
      Mix(term, &value);
    } else {
      value = term;
    }
  }
}

}  // namespace

double TailsOf(int dof) {
  const double normal = ChiSquareTail(kThreshold * kThreshold, 1.0);
  return std::sqrt(FCritical(normal, 1.0, dof)) / kThreshold;
}

double Tolerance(const std::string& parameter, double value, double arm) {
  if (parameter == "r_BM_z") return std::max(0.5 * std::abs(value), kCentreScatter * arm);
  if (parameter.starts_with("r_BM")) return kCentreScatter * arm;
  for (const Scatter& scatter : kScatter) {
    if (scatter.parameter == parameter) {
      return std::max(scatter.share * std::abs(value), scatter.floor);
    }
  }
  return 0.0;
}

NeutralVehicle With(NeutralVehicle vehicle, const std::string& parameter, double value) {
  if (parameter == "k_m/k_f") {
    for (Numbers& rotor : vehicle.rotors) rotor["k_m"] = value * rotor["k_f"];
  } else if (parameter == "k_f" || parameter == "k_m") {
    const double factor = value / vehicle.Get(parameter);
    for (Numbers& rotor : vehicle.rotors) rotor[parameter] *= factor;
  } else if (parameter == "arm") {
    const double factor = value / vehicle.Get("arm");
    for (Numbers& rotor : vehicle.rotors) rotor["x"] *= factor, rotor["y"] *= factor;
  } else {
    const bool lag = parameter == "tau" && vehicle.States("tau_down") && vehicle.Get("tau") > 0.0;
    if (lag) vehicle.body["tau_down"] *= value / vehicle.Get("tau");
    vehicle.body[parameter] = value;
  }
  return vehicle;
}

ErrorByHorizon MeanErrors(const std::vector<FlightEstimate>& flights,
                          const std::vector<NeutralVehicle>& vehicles) {
  ErrorByHorizon mean{};
  for (std::size_t i = 0; i < flights.size(); ++i) {
    const ErrorByHorizon errors = flights[i].ErrorsWith(vehicles[i]);
    for (std::size_t k = 0; k < errors.size(); ++k) {
      mean[k] += errors[k] / static_cast<double>(flights.size());
    }
  }
  return mean;
}

double FlightJudge::Sigma(const std::string& parameter, const FlightValue& value) const {
  return std::hypot(value.sigma, Tolerance(parameter, value.value, arm) / kThreshold);
}

bool FlightJudge::Differs(const std::string& parameter, double stated,
                          const FlightValue& value) const {
  return std::abs(stated - value.value) > kThreshold * Sigma(parameter, value);
}

bool FlightJudge::Compare(const std::string& parameter, double stated, const FlightValue& value,
                          const VehicleFile* file, const Reading* at) const {
  if (!std::isfinite(stated) || !std::isfinite(value.value) || !std::isfinite(value.sigma)) {
    audit->not_judged.push_back(NotShown(parameter, log));
    return false;
  }
  const double tolerance = Tolerance(parameter, value.value, arm);
  const double difference = std::abs(stated - value.value);
  const bool wrong = Differs(parameter, stated, value);
  audit->compared.push_back(
      {parameter, UnitOf(parameter), stated, value.value, value.sigma, tolerance, wrong});
  // Silence means something only where an error of twice the scatter would be seen.
  if (!wrong && kThreshold * value.sigma > std::max(2.0 * tolerance, difference)) {
    audit->not_judged.push_back(NotShown(parameter, log));
  }
  if (!wrong) return false;
  constexpr double kNone = 2.0;  // sigmas: a value that may as well be zero
  const bool is_none = std::abs(value.value) < kNone * value.sigma;
  Contradicted entry{parameter, UnitOf(parameter), stated,
                     is_none ? "the flight shows none of it" : RatioInWords(stated, value.value)};
  entry.flight_value = value.value, entry.sigma = Sigma(parameter, value);
  if (file != nullptr) Place(*file, at, &entry);
  audit->contradicted.push_back(entry);
  return true;
}

std::optional<ErrorByHorizon> FlightJudge::CostOf(const std::string& parameter, double stated,
                                                  double shown) const {
  if (parameter == "tau") return CostOfLag(flights.front().vehicle, stated, shown);
  // Of the height the replay has the moment anyway.
  for (const char* unseen : {"full_speed", "spin", "r_BM_z"}) {
    if (parameter == unseen) return std::nullopt;
  }
  std::vector<NeutralVehicle> changed;
  for (const FlightEstimate& flight : flights) {
    changed.push_back(With(flight.vehicle, parameter, stated));
  }
  ErrorByHorizon cost = MeanErrors(flights, changed);
  for (std::size_t k = 0; k < cost.size(); ++k) {
    const double more = cost[k] - (*audit->best)[k];
    cost[k] = std::isnan(more) ? NAN : std::max(0.0, more);
  }
  return cost;
}

void FlightJudge::AddCosts() const {
  std::vector<NeutralVehicle> own;
  for (const FlightEstimate& flight : flights) own.push_back(flight.vehicle);
  audit->best = MeanErrors(flights, own);
  constexpr double kNothing = 0.02;  // of the errors with the flight's own vehicle
  const auto nothing = [&](const ErrorByHorizon& cost) {
    bool none = true;
    for (std::size_t k = 0; k < cost.size(); ++k) none &= cost[k] < kNothing * (*audit->best)[k];
    return none;
  };
  for (Contradicted& entry : audit->contradicted) {
    if (!entry.flight_value) continue;
    if (!entry.cost) entry.cost = CostOf(entry.parameter, entry.file_value, *entry.flight_value);
    if (entry.cost && nothing(*entry.cost)) {
      entry.text += "; costs nothing in prediction on this flight";
    }
  }
  for (Compared& c : audit->compared) {
    const bool differs = std::abs(c.file_value - c.flight_value) > kThreshold * c.sigma;
    const auto value = flights.front().values.find(c.parameter);
    const bool flown = value != flights.front().values.end() && value->second.size == 0.0;
    if (c.contradicted || !differs || !flown) continue;
    c.cost = CostOf(c.parameter, c.file_value, c.flight_value);
    if (c.cost && !((*c.cost)[1] > kNothing * (*audit->best)[1])) c.cost.reset();
  }
  const auto cost = [](const Contradicted& entry) {
    return entry.cost && !std::isnan((*entry.cost)[1]) ? (*entry.cost)[1] : 0.0;
  };
  std::stable_sort(audit->contradicted.begin(), audit->contradicted.end(),
                   [&](const auto& a, const auto& b) { return cost(a) > cost(b); });
}

double FlightJudge::OneFactor(const std::vector<std::string>& names,
                              const std::vector<std::string>& others,
                              const std::function<double(const std::string&)>& stated,
                              const std::map<std::string, FlightValue>& values) const {
  constexpr double kAlike = 0.1;  // relative, of factors by which two numbers are wrong
  const auto of = [&](const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? FlightValue() : found->second;
  };
  double factor = 0.0, least = INFINITY, most = 0.0, gain = 0.0;
  for (const std::string& name : names) {
    const FlightValue value = of(name);
    if (!value.shown || !Differs(name, stated(name), value)) return 1.0;
    const double each = stated(name) / value.value;
    factor += each / static_cast<double>(names.size());
    least = std::min(least, each), most = std::max(most, each);
  }
  for (const std::string& name : others) {
    const FlightValue value = of(name);
    if (!value.shown) return 1.0;
    const double off = stated(name) - value.value, left = stated(name) / factor - value.value;
    gain += (off * off - left * left) / std::pow(Sigma(name, value), 2);
  }
  const bool explains = others.empty() || gain > kThreshold * kThreshold;
  return most < (1.0 + kAlike) * least && explains ? factor : 1.0;
}

void ScaleValues(std::initializer_list<const char*> names, double factor,
                 std::map<std::string, FlightValue>* values) {
  for (const char* name : names) {
    FlightValue& value = (*values)[name];
    value.value *= factor, value.sigma *= std::abs(factor);
  }
}

bool StatesRotors(const FlightLog& log, const NeutralVehicle& v) {
  return log.vehicle && log.vehicle->rotors.size() == v.rotors.size();
}

std::vector<FlightEstimate> Estimates(const std::vector<FlightLog>& logs,
                                      const NeutralVehicle& start, Audit* audit) {
  std::vector<FlightEstimate> flights;
  for (const FlightLog& log : logs) {
    flights.push_back(EstimateFromFlight(log, InLogOrder(start, log)));
    AddTerms(log, &flights.back());
    audit->logs.push_back(log.directory);
    for (const std::string& warning : flights.back().warnings) {
      audit->warnings.push_back(log.directory + ": " + warning);
    }
  }
  return flights;
}

bool CompareWithLog(const std::string& parameter, double in_file, double stated,
                    const std::string& by, Audit* audit) {
  const double tolerance = Tolerance(parameter, stated, stated);
  const bool wrong = std::abs(in_file - stated) > tolerance;
  const double sigma = tolerance / kThreshold;
  audit->compared.push_back(
      {parameter, UnitOf(parameter), in_file, stated, sigma, tolerance, wrong});
  if (!wrong) return false;
  audit->contradicted.push_back({parameter, UnitOf(parameter), in_file,
                                 RatioInWords(in_file, stated) + "; by " + by + " in log.yaml"});
  audit->contradicted.back().flight_value = stated, audit->contradicted.back().sigma = sigma;
  return true;
}

double ArmOfRotors(const std::vector<Rotor>& rotors) {
  const auto count = static_cast<double>(rotors.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double arm = 0.0;
  for (const Rotor& rotor : rotors) middle += rotor.position / count;
  for (const Rotor& rotor : rotors) arm += (rotor.position - middle).head<2>().norm() / count;
  return arm;
}

void AddSpin(const VehicleFile* file, double spin, const std::string& text, Audit* audit) {
  Contradicted entry{"spin", "", spin, text};
  if (file != nullptr) Place(*file, file->Find("spin"), &entry);
  audit->contradicted.push_back(entry);
}

void CompareSpins(const VehicleFile* file, const FlightLog& log, const std::vector<int>& order,
                  NeutralVehicle* start, Audit* audit) {
  std::string others;
  double spin = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    double& stated = start->rotors[static_cast<std::size_t>(order[i])]["spin"];
    if (stated == log.vehicle->rotors[i].spin) continue;
    spin = stated, stated = log.vehicle->rotors[i].spin;
    others += fmt::format("{}{}", others.empty() ? "" : ", ", order[i]);
  }
  if (others.empty()) return;
  AddSpin(file, spin,
          fmt::format("rotors {} turn the other way than log.yaml says: spins, or the order of the "
                      "rotors",
                      others),
          audit);
}

ErrorByHorizon ProofOf(const NeutralVehicle& vehicle, const std::vector<FlightEstimate>& flights,
                       const std::vector<FlightLog>& logs, const Audit& audit) {
  std::vector<NeutralVehicle> flown;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    flown.push_back(InLogOrder(vehicle, logs[i]));
    for (const char* name : {"r_BM_x", "r_BM_y"}) {
      if (!Names(audit.contradicted, name)) flown.back().body[name] = flights[i].vehicle.Get(name);
    }
  }
  return MeanErrors(flights, flown);
}

void JudgeOnce(Audit* audit) {
  std::erase_if(audit->not_judged,
                [&](const NotJudged& n) { return Names(audit->contradicted, n.parameter); });
}

}  // namespace trueline
