#include "problems/calibration/result_files.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <string_view>

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/rotor_constants.h"
#include "problems/effects/read_effects.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

// What a parameter of either drive is, in words. Empty for a name that neither table has.
std::string MeaningOf(std::string_view name) {
  for (const ParameterInfo& info : kTheta) {
    if (info.name == name) return info.meaning;
  }
  const int constant = FindRotorConstant(name);
  return constant < 0 ? "" : kRotorConstants[constant].meaning;
}

}  // namespace

void WriteParameterRow(std::ostream& out, const std::string& window, const ParameterEstimate& p) {
  fmt::print(out, "{},{},{:.8g},{:.6g},{},{}\n", window, p.name, p.value, p.sigma, p.unit,
             p.status);
}

YAML::Node VerdictNode(const Verdict& verdict, const std::vector<std::string>& warnings) {
  YAML::Node node;
  node["verdict"] = verdict.word;
  node["reasons"] = verdict.reasons;
  node["warnings"] = warnings;
  return node;
}

YAML::Node ParameterNode(const std::vector<ParameterEstimate>& parameters) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ParameterEstimate& p : parameters) {
    YAML::Node entry = FlowMap({{"value", Rounded(p.value, 6)},
                                {"sigma", Rounded(p.sigma, 3)},
                                {"unit", p.unit},
                                {"status", p.status}});
    if (const std::string meaning = MeaningOf(p.name); !meaning.empty()) entry["meaning"] = meaning;
    node[p.name] = entry;
  }
  return node;
}

YAML::Node ModelNode(const std::vector<ParameterEstimate>& parameters,
                     const std::vector<Effect>& effects, const YAML::Node& provenance) {
  YAML::Node node;
  node["parameters"] = ParameterNode(parameters);
  node["effects"] = EffectsNode(effects);
  node["effects"].SetStyle(YAML::EmitterStyle::Flow);
  node["provenance"] = provenance;
  return node;
}

std::string UnobservableText(const std::vector<std::string>& combinations) {
  std::string text;
  for (const std::string& combination : combinations) {
    text += fmt::format("  not shown by this flight: {}\n", combination);
  }
  return text;
}

std::string VerdictText(const Verdict& verdict) {
  std::string text = fmt::format("\nverdict: {}\n", verdict.word);
  for (const std::string& reason : verdict.reasons) text += "  " + reason + "\n";
  return text;
}

}  // namespace trueline
