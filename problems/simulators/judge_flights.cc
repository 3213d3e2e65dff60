#include "problems/simulators/judge_flights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/result/statistics.h"
#include "problems/simulators/describe_audit.h"
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
  Contradicted entry;
  entry.parameter = parameter, entry.unit = UnitOf(parameter);
  entry.file_value = stated, entry.flight_value = value.value;
  entry.sigma = Sigma(parameter, value);
  entry.text = std::abs(value.value) < kNone * value.sigma ? "the flight shows none of it"
                                                           : RatioInWords(stated, value.value);
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

}  // namespace trueline
