#include "problems/inspection/write_inspection.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "problems/common/app.h"
#include "problems/common/units.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node FindingNode(const Finding& f) {
  YAML::Node node;
  node["id"] = f.id;
  node["stream"] = f.stream;
  node["level"] = NameOf(f.level);
  node["size"] = Rounded(f.size, 5);
  if (std::isfinite(f.sigma)) node["sigma"] = Rounded(f.sigma, 3);
  node["unit"] = f.unit;
  if (f.error > 0.0) {
    node["force_error"] = FlowMap({{"value", Rounded(f.error, 3)}, {"unit", "m/s^2"}});
  }
  node["text"] = f.text;
  node["remedy"] = f.remedy;
  node["repaired"] = f.repaired;
  return node;
}

YAML::Node AxisNode(const AxisHealth& axis) {
  const std::string unit = axis.axis[0] == 'a' ? "m/s^2" : "rad/s";
  return FlowMap({{"axis", axis.axis},
                  {"unit", unit},
                  {"quantum", Rounded(axis.quantum, 4)},
                  {"noise_density_per_sqrt_Hz", Rounded(axis.noise.density, 3)},
                  {"above_20_Hz_rms", Rounded(axis.noise.vibration, 3)},
                  {"line_Hz", Rounded(axis.noise.peak, 3)},
                  {"cutoff_Hz", Rounded(axis.noise.cutoff, 3)},
                  {"spikes", fmt::format("{}", axis.spikes)}});
}

YAML::Node StreamNode(const StreamHealth& h) {
  YAML::Node node = FlowMap({{"stream", h.stream},
                             {"samples", fmt::format("{}", h.count)},
                             {"rate_Hz", Rounded(h.rate, 5)},
                             {"jitter_s", Rounded(h.jitter, 3)},
                             {"gaps", fmt::format("{}", h.gaps)},
                             {"longest_gap_s", Rounded(h.longest, 4)},
                             {"repeats", Rounded(h.repeats, 3)},
                             {"spikes", fmt::format("{}", h.spikes)}});
  if (h.axes.empty()) return node;
  node.SetStyle(YAML::EmitterStyle::Block);
  for (const AxisHealth& axis : h.axes) node["axes"].push_back(AxisNode(axis));
  return node;
}

YAML::Node ComparisonNode(const MotionComparison& c) {
  YAML::Node node;
  node["stream"] = c.stream;
  node["what"] = c.what;
  node["shown"] = c.not_shown.empty();
  if (!c.not_shown.empty()) node["why_not"] = c.not_shown;
  if (!c.match) return node;
  const VectorMatch& m = *c.match;
  node["correlation"] = Rounded(m.correlation, 4);
  if (!c.not_shown.empty()) return node;
  node["late_by"] =
      FlowMap({{"value", Rounded(m.lag, 4)}, {"sigma", Rounded(m.lag_sigma, 2)}, {"unit", "s"}});
  if (std::isfinite(m.drift_sigma)) {
    node["drift"] = FlowMap(
        {{"value", Rounded(m.drift, 3)}, {"sigma", Rounded(m.drift_sigma, 2)}, {"unit", "s/s"}});
  }
  const Eigen::Vector3d turn = TurnBetween(m.turn, Eigen::Matrix3d::Identity()) / kDegree;
  YAML::Node angle;
  for (int i = 0; i < 3; ++i) {
    angle["value"].push_back(Rounded(turn[i], 4));
    angle["sigma"].push_back(Rounded(std::sqrt(m.turn_cov(i, i)) / kDegree, 2));
  }
  angle["unit"] = "deg";
  angle.SetStyle(YAML::EmitterStyle::Flow);
  node["turned_by"] = angle;
  node["mirrored"] = m.turn.determinant() < 0.0;
  node["handedness_sigmas"] = Rounded(std::abs(m.reflection), 3);
  node["size_ratio"] =
      FlowMap({{"value", Rounded(m.gain, 5)}, {"sigma", Rounded(m.gain_sigma, 2)}, {"unit", "1"}});
  return node;
}

YAML::Node RotorsNode(const RotorLayout& layout) {
  YAML::Node node;
  node["stream"] = layout.stream;
  node["answer_after"] = FlowMap({{"value", Rounded(layout.lag, 3)}, {"unit", "s"}});
  node["explained"] = FlowMap({{"roll", Rounded(layout.explained.x(), 3)},
                               {"pitch", Rounded(layout.explained.y(), 3)},
                               {"yaw", Rounded(layout.explained.z(), 3)}});
  for (std::size_t i = 0; i < layout.rotors.size(); ++i) {
    const auto word = [](int sign, const char* plus, const char* minus) {
      return std::string(sign > 0 ? plus : sign < 0 ? minus : "not shown");
    };
    node["channels"].push_back(FlowMap({{"front", word(layout.FrontOf(i), "front", "rear")},
                                        {"side", word(layout.RightOf(i), "right", "left")},
                                        {"spin", word(layout.SpinOf(i), "1", "-1")}}));
  }
  return node;
}

}  // namespace

std::string InspectionYaml(const Inspection& inspection, const std::string& log,
                           const std::string& corrected) {
  YAML::Node node;
  node["log"] = log;
  node["findings"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Finding& finding : inspection.findings) {
    node["findings"].push_back(FindingNode(finding));
  }
  if (!corrected.empty()) node["corrected_by"] = corrected;
  node["not_checked"] = inspection.notes;
  for (const MotionComparison& comparison : inspection.comparisons) {
    node["comparisons"].push_back(ComparisonNode(comparison));
  }
  if (inspection.rotors) node["rotors"] = RotorsNode(*inspection.rotors);
  for (const StreamHealth& health : inspection.streams) {
    node["streams"].push_back(StreamNode(health));
  }
  node["provenance"]["version"] = Version();
  return TextOf(node);
}

std::string InspectionTable(const Inspection& inspection) {
  std::string text;
  if (inspection.findings.empty()) {
    text = inspection.notes.empty() ? "No fault was found.\n"
                                    : "No fault was found in what could be checked.\n";
  }
  for (const Finding& f : inspection.findings) {
    text += fmt::format("{:<7} {:<21} {}\n        {}\n", NameOf(f.level), f.id, f.text,
                        f.remedy + (f.repaired ? " [in corrected_map.yaml]" : ""));
  }
  for (const std::string& note : inspection.notes) {
    text += fmt::format("not checked: {}\n", note);
  }
  return text;
}

}  // namespace trueline
