#include "problems/observability/observe.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/app.h"
#include "problems/common/parallel.h"
#include "problems/observability/variational_gramian.h"
#include "problems/result/yaml_text.h"
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

namespace {

struct NullVector {
  std::string label;
  std::vector<std::string> names;
  std::vector<double> numbers;
  std::vector<std::string> units;
};

std::vector<NullVector> NullVectors(const CaseResult& result) {
  std::vector<NullVector> vectors;
  for (const NullBlock& block : result.rank.blocks) {
    for (Eigen::Index k = 0; k < block.directions.cols(); ++k) {
      NullVector vector;
      vector.label = block.label;
      for (std::size_t i = 0; i < block.states.size(); ++i) {
        if (block.support(i, k) == 0.0) continue;
        const StateInfo& info = result.info[block.states[i]];
        vector.names.push_back(info.name);
        vector.units.push_back(info.unit);
        vector.numbers.push_back(block.directions(i, k));
      }
      vectors.push_back(vector);
    }
  }
  return vectors;
}

std::string Number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : std::isnan(value) ? ".nan" : ".inf";
}

std::string NullSpaceYaml(const CaseResult& result) {
  const std::vector<NullVector> vectors = NullVectors(result);
  if (vectors.empty()) return "    null_space: []\n";
  std::string text = "    null_space:\n";
  for (const NullVector& vector : vectors) {
    std::vector<std::string> direction;
    for (std::size_t i = 0; i < vector.names.size(); ++i) {
      direction.push_back(fmt::format("{}: {}", vector.names[i], Number(vector.numbers[i])));
    }
    text += fmt::format("      - {{{}states: [{}], direction: {{{}}}}}\n",
                        vector.label.empty() ? "" : "label: " + vector.label + ", ",
                        fmt::join(vector.names, ", "), fmt::join(direction, ", "));
  }
  return text;
}

std::string BoundsYaml(const std::string& key, const CaseResult& result,
                       const std::vector<double>& sigma) {
  std::string text = fmt::format("    {}:\n", key);
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    const StateInfo& info = result.info[result.rank.states[i]];
    if (std::isnan(sigma[i])) continue;
    text +=
        fmt::format("      {}: {{value: {}, unit: {}}}\n", info.name, Number(sigma[i]), info.unit);
  }
  return text;
}

std::string FlightYaml(const CaseResult& result) {
  std::string text = fmt::format(
      "    duration: {:.6g}  # s\n    horizon: {:.6g}  # s, over which the motion model is "
      "trusted\n"
      "    sigma_min: {}\n    condition: {}\n    log10_determinant: {}\n",
      result.duration, result.horizon, Number(result.scores.sigma_min),
      Number(result.scores.condition), Number(result.scores.log10_determinant));
  text += BoundsYaml("crlb", result, result.sigma);
  text += BoundsYaml("crlb_whole_flight", result, result.sigma_whole);
  text += result.advice.empty() ? "    advice: []\n" : "    advice:\n";
  for (const Advice& advice : result.advice) {
    const StateInfo& info = result.info[advice.state];
    text += fmt::format("      - {{state: {}, fly: {}, sigma: {}, unit: {}}}\n", info.name,
                        Quoted(advice.manoeuvre), Number(advice.sigma), info.unit);
  }
  return text;
}

std::string CaseYaml(const CaseResult& result) {
  std::string text = fmt::format(
      "  - name: {}\n    sensors: [{}]\n    inputs: {}\n    states: {}\n    error_states: {}\n"
      "    rank: {}\n    exact: {}\n",
      Quoted(result.name), result.sensors, Quoted(result.inputs), result.states,
      result.rank.states.size(), result.rank.rank, result.rank.exact);
  text += NullSpaceYaml(result) + "    per_state: {";
  for (std::size_t i = 0; i < result.rank.states.size(); ++i) {
    const std::string status = result.rank.StatusOf(result.rank.states[i]);
    text += fmt::format("{}{}: {}", i == 0 ? "" : ", ", result.info[result.rank.states[i]].name,
                        status.find(':') == std::string::npos ? status : Quoted(status));
  }
  text += "}\n";
  return result.rank.exact ? text : text + FlightYaml(result);
}

int CountUnseen(const CaseResult& result) {
  return static_cast<int>(
      std::count_if(result.rank.blocks.begin(), result.rank.blocks.end(),
                    [](const NullBlock& block) { return block.label.empty(); }));
}

std::string NullSpaceText(const CaseResult& result) {
  std::string text, unseen;
  for (const NullVector& vector : NullVectors(result)) {
    if (vector.label.empty()) {
      unseen += (unseen.empty() ? "" : ", ") + vector.names.front();
      continue;
    }
    std::vector<std::string> parts;
    for (std::size_t i = 0; i < vector.names.size(); ++i) {
      parts.push_back(
          fmt::format("{} {:+.4g} {}", vector.names[i], vector.numbers[i], vector.units[i]));
    }
    text += fmt::format("  only jointly ({}): {}\n", vector.label, fmt::join(parts, ", "));
  }
  if (!unseen.empty()) text += fmt::format("  not seen: {}\n", unseen);
  if (text.empty()) {
    text = result.rank.exact
               ? "  every state is seen\n"
               : "  every state is seen, if the model is exact for the whole flight\n";
  }
  return text;
}

std::string FlightText(const CaseResult& result) {
  std::string text =
      fmt::format("  {:<12} {:>12} {:>14}  {}\n", "parameter", "sigma", "whole flight", "unit");
  for (std::size_t i = 0; i < result.sigma.size(); ++i) {
    const StateInfo& info = result.info[result.rank.states[i]];
    if (info.moving) continue;
    const auto cell = [](double value) {
      return std::isfinite(value) ? fmt::format("{:.2e}", value) : std::string("not seen");
    };
    text += fmt::format("  {:<12} {:>12} {:>14}  {}\n", info.name, cell(result.sigma[i]),
                        cell(result.sigma_whole[i]), info.unit);
  }
  text += fmt::format("  sigma: the motion model trusted for {:.3g} s at a time\n", result.horizon);
  for (const Advice& advice : result.advice) {
    const StateInfo& info = result.info[advice.state];
    text += fmt::format("  for {}: fly {} for 10 s (sigma {:.2e} {})\n", info.name,
                        advice.manoeuvre, advice.sigma, info.unit);
  }
  return text;
}

}  // namespace

std::string ObservabilityYaml(const std::vector<CaseResult>& cases, const std::string& source) {
  std::string text =
      fmt::format("provenance: {{version: {}, source: {}}}\ncases:\n", Version(), Quoted(source));
  for (const CaseResult& result : cases) text += CaseYaml(result);
  return text;
}

std::string ObservabilityTable(const std::vector<CaseResult>& cases) {
  std::string text;
  for (const CaseResult& result : cases) {
    const int asked = static_cast<int>(result.rank.states.size());
    text += fmt::format(
        "{}: sensors {}; motion {}\n  rank {} of {} ({}); {} of {} without those "
        "not seen at all\n",
        result.name, result.sensors, result.inputs, result.rank.rank, asked,
        result.rank.exact ? "exact" : "this flight", result.rank.rank, asked - CountUnseen(result));
    text += NullSpaceText(result);
    if (!result.rank.exact) text += FlightText(result);
    text += "\n";
  }
  return text;
}

std::string ObservabilityBrief(const std::vector<CaseResult>& cases) {
  std::string text;
  for (const CaseResult& result : cases) {
    text += fmt::format("{}: rank {} of {} ({})", result.name, result.rank.rank,
                        result.rank.states.size(), result.rank.exact ? "exact" : "this flight");
    std::vector<std::string> unseen;
    for (const NullVector& vector : NullVectors(result)) {
      if (vector.label.empty())
        unseen.push_back(vector.names.front());
      else
        text += fmt::format("; only jointly {}", fmt::join(vector.names, ", "));
    }
    text += unseen.empty() ? "\n" : fmt::format("; not seen {}\n", fmt::join(unseen, ", "));
  }
  return text;
}

}  // namespace trueline
