#include "problems/observability/observe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/parallel.h"
#include "problems/observability/windowed_information.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<double> ScaleOf(const FlightQuestion& question, const std::vector<StateInfo>& info) {
  return question.scale.empty() ? TypicalSizes(info) : question.scale;
}

// Sigmas of the constants from windowed information, in the order of `states`.
std::vector<double> ConstantSigmas(const Eigen::MatrixXd& windowed, const std::vector<int>& states,
                                   const std::vector<StateInfo>& info) {
  const std::vector<int> constants = ConstantsOf(states, info);
  const Assessment assessment = Assess(windowed, constants, info);
  std::vector<double> sigma(states.size(), kNan);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const auto at = std::find(constants.begin(), constants.end(), states[i]);
    if (at != constants.end()) sigma[i] = assessment.sigma[at - constants.begin()];
  }
  return sigma;
}

template <class System>
CaseResult ObserveFlight(const System& system, const NominalFlight& flight,
                         const FlightQuestion& question) {
  CaseResult result;
  result.name = question.name;
  result.inputs = question.flight;
  result.info = system.errors();
  result.duration = flight.end - flight.start;
  result.horizon = std::min(question.horizon, result.duration);
  const std::vector<double> weights = system.OutputWeights();
  const Eigen::MatrixXd whole = VariationalGramian(system, flight, weights, question.step);
  const Assessment assessment = Assess(whole, question.states, result.info);
  result.rank = assessment.rank;
  result.sigma_whole = assessment.sigma;
  const Eigen::MatrixXd windowed =
      WindowedInformation(system, flight, weights, question.states, result.horizon, question.step);
  result.sigma = ConstantSigmas(windowed, question.states, result.info);
  std::vector<int> seen;
  for (std::size_t i = 0; i < question.states.size(); ++i) {
    if (std::isfinite(result.sigma[i])) seen.push_back(question.states[i]);
  }
  if (!seen.empty()) {
    result.scores = ScoreStates(windowed, seen, seen, ScaleOf(question, result.info));
  }
  return result;
}

int CountStates(const std::vector<int>& states, bool quaternion) {
  const bool attitude = quaternion && std::count(states.begin(), states.end(), 0) > 0;
  return static_cast<int>(states.size()) + (attitude ? 1 : 0);
}

}  // namespace

std::string SensorNames(const SensorSet& sensors) {
  std::string names;
  const auto add = [&](bool there, const char* name) {
    if (there) names += names.empty() ? name : std::string(", ") + name;
  };
  add(sensors.imu, "imu"), add(sensors.position, "position"), add(sensors.pose, "pose");
  return names;
}

CaseResult ObserveRotorMotion(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                              const std::string& name, const std::vector<int>& states,
                              Motion motion) {
  const char* words[] = {"any, inputs vary", "any, inputs constant", "hover",
                         "straight up and down", "straight ahead and back"};
  CaseResult result;
  result.name = name;
  result.sensors = SensorNames(system.sensors());
  result.inputs = words[static_cast<int>(motion)];
  result.info = system.errors();
  result.states = CountStates(states, true);
  result.rank = RotorDrivenRank(system, vehicle.parameters, states, motion);
  return result;
}

CaseResult ObserveImuMotion(const ImuDrivenSystem& system, const std::string& name,
                            const std::vector<int>& states, Turning turning) {
  const char* words[] = {"any", "constant heading", "pitching only", "constant attitude"};
  CaseResult result;
  result.name = name;
  result.sensors = "position";
  result.inputs = words[static_cast<int>(turning)];
  result.info = system.errors();
  result.states = CountStates(states, false);
  result.rank = ImuDrivenRank(system, states, turning);
  return result;
}

CaseResult ObserveRotorFlight(const RotorDrivenSystem& system, const NominalFlight& flight,
                              const FlightQuestion& question) {
  CaseResult result = ObserveFlight(system, flight, question);
  result.sensors = SensorNames(system.sensors());
  result.states = CountStates(question.states, true);
  return result;
}

CaseResult ObserveImuFlight(const ImuDrivenSystem& system, const NominalFlight& flight,
                            const FlightQuestion& question) {
  CaseResult result = ObserveFlight(system, flight, question);
  result.sensors = "position";
  result.states = CountStates(question.states, false);
  return result;
}

void AdviseRotorFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                       const NominalFlight& flight, const FlightQuestion& question,
                       const FlightLimits& limits, CaseResult* result) {
  const std::vector<double> weights = system.OutputWeights();
  const auto information = [&](const NominalFlight& of) {
    return WindowedInformation(system, of, weights, question.states, question.horizon,
                               question.step);
  };
  const Eigen::MatrixXd own = information(flight);
  const std::vector<Manoeuvre> manoeuvres = PlainManoeuvres();
  std::vector<std::vector<double>> sigmas(manoeuvres.size());
  ParallelFor(static_cast<int>(manoeuvres.size()), 0, [&](int i) {
    const auto path = ScaledToLimits(vehicle.model, vehicle.parameters,
                                     LissajousPath(manoeuvres[i].figure, 10.0), limits, 0.02, 1.0);
    const RotorFlight flown(vehicle.model, vehicle.parameters, path);
    sigmas[i] = ConstantSigmas(own + information(flown.Nominal()), question.states, result->info);
  });
  const std::vector<double> scale = ScaleOf(question, result->info);
  for (std::size_t j = 0; j < question.states.size(); ++j) {
    if (result->info[question.states[j]].moving) continue;
    std::size_t best = 0;
    for (std::size_t i = 1; i < sigmas.size(); ++i) {
      if (sigmas[i][j] < 0.98 * sigmas[best][j]) best = i;  // on near ties the simpler, earlier one
    }
    if (!std::isfinite(sigmas[best][j])) continue;
    const double now = result->sigma[j];
    if (std::isfinite(now) && now < 0.5 * scale[question.states[j]] &&
        sigmas[best][j] > 0.5 * now) {
      continue;
    }
    if (sigmas[best][j] > 0.7 * now) continue;
    result->advice.push_back({question.states[j], manoeuvres[best].name, sigmas[best][j]});
  }
}

}  // namespace trueline
