#include "problems/result/yaml_text.h"

#include <fmt/format.h>

#include <cmath>

namespace trueline {

std::string Rounded(double value, int digits) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  std::string text = fmt::format("{:.{}g}", value, digits);
  const auto exponent = text.find('e');
  // YAML 1.1 reads 1e-05 as a string.
  if (exponent != std::string::npos && text.find('.') == std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

std::string RoundedOrWhole(double value, int digits) {
  constexpr int kDigitsOfWhole = 15;
  return Rounded(value, value == std::round(value) ? kDigitsOfWhole : digits);
}

std::string Quoted(const std::string& text) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << text;
  return emitter.c_str();
}

YAML::Node FlowMap(std::initializer_list<std::pair<const char*, std::string>> entries) {
  YAML::Node node(YAML::NodeType::Map);
  for (const auto& [key, value] : entries) node[key] = value;
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

std::string TextOf(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter << node;
  return std::string(emitter.c_str()) + "\n";
}

}  // namespace trueline
