#include "problems/calibration/considered.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "problems/effects/declaration.h"

namespace trueline {
namespace {

// Effects whose forces are proportional to their size and act throughout the flight.
const std::map<std::string, std::vector<std::string>>& Considerable() {
  static const auto effects = [] {
    std::map<std::string, std::vector<std::string>> proportional;
    for (const EffectInfo* info : CausesOf(DriveKind::kRotors)) {
      if (info->enters_squared || info->HasIndex("t_step")) continue;
      for (const auto& parameter : info->parameters) {
        proportional[info->id].push_back(parameter.name);
      }
    }
    return proportional;
  }();
  return effects;
}

bool IsEstimated(const RotorPrior& prior, const ConsideredEffect& considered) {
  for (const auto& parameter : FindDeclared(considered.id, DriveKind::kRotors)->parameters) {
    if (parameter.name == considered.parameter) return prior.Estimates(parameter.constant);
  }
  return false;
}

std::vector<Effect> AtOneSigma(const ConsideredEffect& considered, int rotors) {
  if (considered.id != "rotor_loss") {
    return {{considered.id, {{considered.parameter, considered.sigma}}}};
  }
  std::vector<Effect> losses;
  losses.reserve(rotors);
  for (int i = 0; i < rotors; ++i) {
    losses.push_back({considered.id, {{"rotor", i}, {"factor", 1.0 + considered.sigma}}});
  }
  return losses;
}

}  // namespace

std::vector<ConsideredEffect> ReadConsidered(const YamlMap& map) {
  std::vector<ConsideredEffect> considered;
  for (const auto& [id, parameters] : Considerable()) {
    if (!map.Has(id)) continue;
    const YamlMap entry = map.Child(id);
    for (const std::string& parameter : parameters) {
      const auto sigma = entry.GetOptional<double>(parameter);
      if (!sigma) continue;
      if (!(*sigma > 0.0)) entry.Fail(parameter, "is a standard deviation, above zero");
      considered.push_back({id, parameter, *sigma});
    }
    entry.Finish();
  }
  for (const std::string& key : map.Keys()) {
    if (Considerable().count(key) > 0) continue;
    std::vector<std::string> known;
    for (const auto& [id, parameters] : Considerable()) known.push_back(id);
    map.Fail(key, fmt::format("can't be considered; known here: {}", fmt::join(known, ", ")));
  }
  return considered;
}

const std::vector<std::string>& ConsiderableParameters(const std::string& id) {
  return Considerable().at(id);
}

YAML::Node ToYaml(const std::vector<ConsideredEffect>& considered) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ConsideredEffect& c : considered) node[c.id][c.parameter] = c.sigma;
  return node;
}

std::vector<RotorVariant> ConsideredVariants(const FlightLog& log,
                                             const RotorCalibrationOptions& options,
                                             const RotorDataOptions& streams) {
  const std::vector<Rotor>& rotors = options.vehicle.model.rotors();
  const int count = static_cast<int>(rotors.size());
  std::vector<RotorVariant> variants;
  for (const ConsideredEffect& considered : options.considered) {
    const bool in_model = std::any_of(options.effects.begin(), options.effects.end(),
                                      [&](const Effect& e) { return e.id == considered.id; });
    if (in_model || IsEstimated(options.prior, considered)) continue;
    for (const Effect& effect : AtOneSigma(considered, count)) {
      std::vector<Effect> all = options.effects;
      all.push_back(effect);
      const RotorExtension move = RotorExtensionOf({effect});
      RotorVariant variant{RotorAeroModel(rotors, log.gravity, RotorEffectsOn(log, all)),
                           move.added, nullptr};
      if (move.motor_lag > 0.0) {
        RotorDataOptions lagged = streams;
        lagged.motor_lag += move.motor_lag;
        variant.data = std::make_shared<RotorData>(MakeRotorData(log, count, lagged));
      }
      variants.push_back(std::move(variant));
    }
  }
  return variants;
}

}  // namespace trueline
