#include "problems/observability/observe.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/parallel.h"
#include "problems/observability/variational_gramian.h"
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
CaseResult NewCase(const System& system, const std::string& name, const std::string& inputs,
                   const std::vector<int>& states) {
  CaseResult result;
  result.name = name;
  result.sensors = system.SensorNames();
  result.inputs = inputs;
  result.info = system.errors();
  result.states = System::CountStates(states);
  return result;
}

}  // namespace

CaseResult ObserveRotorMotion(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                              const std::string& name, const std::vector<int>& states,
                              Motion motion) {
  const char* words[] = {"any, inputs vary", "any, inputs constant", "hover",
                         "straight up and down", "straight ahead and back"};
  CaseResult result = NewCase(system, name, words[static_cast<int>(motion)], states);
  result.rank = RotorDrivenRank(system, vehicle.parameters, states, motion);
  return result;
}

CaseResult ObserveImuMotion(const ImuDrivenSystem& system, const std::string& name,
                            const std::vector<int>& states, Turning turning) {
  const char* words[] = {"any", "constant heading", "pitching only", "constant attitude"};
  CaseResult result = NewCase(system, name, words[static_cast<int>(turning)], states);
  result.rank = ImuDrivenRank(system, states, turning);
  return result;
}

template <class System>
CaseResult ObserveFlight(const System& system, const NominalFlight& flight,
                         const FlightQuestion& question) {
  CaseResult result = NewCase(system, question.name, question.flight, question.states);
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

template CaseResult ObserveFlight(const RotorDrivenSystem&, const NominalFlight&,
                                  const FlightQuestion&);
template CaseResult ObserveFlight(const ImuDrivenSystem&, const NominalFlight&,
                                  const FlightQuestion&);

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
    const auto path =
        ScaledToLimits(vehicle, LissajousPath(manoeuvres[i].figure, 10.0), limits, 0.02, 1.0);
    const RotorFlight flown(vehicle, path);
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
