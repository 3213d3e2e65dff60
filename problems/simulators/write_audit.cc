#include "problems/simulators/write_audit.h"

#include <fmt/format.h>

#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node ErrorsNode(const ErrorByHorizon& errors) {
  return FlowMap({{"0.25", Rounded(errors[0], 4)},
                  {"0.5", Rounded(errors[1], 4)},
                  {"1.0", Rounded(errors[2], 4)},
                  {"unit", "m"}});
}

YAML::Node Sequence() { return YAML::Node(YAML::NodeType::Sequence); }

YAML::Node ContradictedNode(const Contradicted& c) {
  YAML::Node node;
  node["parameter"] = c.parameter;
  node["file_value"] = YAML::Load(Rounded(c.file_value, 6));
  if (c.flight_value) {
    node["flight_value"] = YAML::Load(Rounded(*c.flight_value, 6));
    node["sigma"] = YAML::Load(Rounded(c.sigma, 3));
  }
  node["unit"] = c.unit;
  if (c.cost) node["cost"] = ErrorsNode(*c.cost);
  if (!c.confused_with.empty()) node["confused_with"] = c.confused_with;
  node["text"] = c.text;
  if (!c.file.empty()) {
    node["place"] =
        FlowMap({{"file", c.file}, {"line", fmt::format("{}", c.line)}, {"key", c.key}});
  }
  return node;
}

}  // namespace

void WriteAudit(const Audit& audit, const std::filesystem::path& directory) {
  YAML::Node node;
  node["simulator"] = audit.simulator;
  node["logs"] = audit.logs;
  node["contradicted"] = Sequence();
  for (const Contradicted& c : audit.contradicted) {
    node["contradicted"].push_back(ContradictedNode(c));
  }
  node["not_judged"] = Sequence();
  for (const NotJudged& n : audit.not_judged) {
    node["not_judged"].push_back(FlowMap({{"parameter", n.parameter}, {"fly", n.fly}}));
  }
  node["lacks"] = Sequence();
  for (const Lack& lack : audit.lacks) {
    node["lacks"].push_back(FlowMap({{"effect", lack.effect}, {"text", lack.text}}));
  }
  node["compared"] = Sequence();
  for (const Compared& c : audit.compared) {
    node["compared"].push_back(FlowMap({{"parameter", c.parameter},
                                        {"file_value", Rounded(c.file_value, 5)},
                                        {"flight_value", Rounded(c.flight_value, 5)},
                                        {"sigma", Rounded(c.sigma, 3)},
                                        {"tolerance", Rounded(c.tolerance, 3)},
                                        {"unit", c.unit},
                                        {"contradicted", c.contradicted ? "true" : "false"}}));
  }
  if (audit.before) node["before"] = ErrorsNode(*audit.before);
  if (audit.after) node["after"] = ErrorsNode(*audit.after);
  if (audit.best) node["flight"] = ErrorsNode(*audit.best);
  node["warnings"] = audit.warnings;
  WriteFileAtomically(directory / "audit.yaml", TextOf(node));
  for (const auto& [name, text] : audit.corrected) WriteFileAtomically(directory / name, text);
}

std::string AuditTable(const Audit& audit) {
  std::string table;
  for (const Contradicted& c : audit.contradicted) {
    table += fmt::format("contradicted: {:<17} ", c.parameter);
    if (c.flight_value) {
      table += fmt::format("file {:.4g}, flight {:.4g} +- {:.2g} {}", c.file_value, *c.flight_value,
                           c.sigma, c.unit);
      if (c.cost) table += fmt::format("; costs {:.3f} m in 0.5 s", (*c.cost)[1]);
      if (!c.text.empty()) table += "; " + c.text;
    } else {
      table += fmt::format("file {:.4g} {}; {}", c.file_value, c.unit, c.text);
    }
    if (c.line > 0) table += fmt::format(" ({}:{})", c.file, c.line);
    table += "\n";
  }
  if (audit.contradicted.empty()) table += "nothing is contradicted\n";
  for (const Compared& c : audit.compared) {
    if (c.contradicted) continue;
    table += fmt::format("agrees:       {:<17} file {:.4g}, flight {:.4g} +- {:.2g} {}\n",
                         c.parameter, c.file_value, c.flight_value, c.sigma, c.unit);
  }
  for (const Lack& lack : audit.lacks) {
    table += fmt::format("lacks:        {}: {}\n", lack.effect, lack.text);
  }
  for (const NotJudged& n : audit.not_judged) {
    table += fmt::format("not judged:   {:<17} {}\n", n.parameter, n.fly);
  }
  if (audit.before && audit.after) {
    for (std::size_t k = 0; k < kHorizons.size(); ++k) {
      table +=
          fmt::format("held-out flight, {:.2f} s: {:.3f} m with the file, {:.3f} m corrected\n",
                      kHorizons[k], (*audit.before)[k], (*audit.after)[k]);
    }
  }
  return table;
}

}  // namespace trueline
