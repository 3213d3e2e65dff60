#include "problems/simulators/write_export.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"
#include "problems/simulators/describe_audit.h"

namespace trueline {

void WriteExport(const Export& exported, const Target& target, const std::filesystem::path& out) {
  for (std::size_t i = 0; i < exported.files.size(); ++i) {
    std::filesystem::path path = out;
    if (i > 0) path.replace_extension(exported.files[i].extension);
    if (i > 0 && path == out) path += exported.files[i].extension;
    WriteFileAtomically(path, exported.files[i].text);
  }
  YAML::Node node;
  node["target"] = target.name;
  node["lost"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Loss& loss : exported.lost) {
    YAML::Node entry = FlowMap({{"parameter", loss.name},
                                {"model", Rounded(loss.model, 4)},
                                {"file", Rounded(loss.file, 4)},
                                {"unit", loss.unit}});
    if (loss.cost) entry["cost"] = YAML::Load(Rounded(*loss.cost, 3));
    entry["text"] = loss.text;
    node["lost"].push_back(entry);
  }
  node["cost"] = FlowMap(
      {{"all", std::isfinite(exported.cost) ? Rounded(exported.cost, 3) : std::string("diverges")},
       {"unit", "m"},
       {"after", Rounded(kCostSeconds, 3)},
       {"speed", Rounded(kCostSpeed, 3)}});
  node["assumed"] = exported.assumed;
  node["equations"] = target.caveat;
  WriteFileAtomically(out.string() + ".lost.yaml", TextOf(node));
}

std::string LossText(const Export& exported, const Target& target) {
  std::string text;
  for (const Loss& loss : exported.lost) {
    text += fmt::format("not as in the model: {} ({}): {:.4g} {}, the file has {:.4g}{}\n",
                        loss.name, loss.text, loss.model, loss.unit, loss.file,
                        loss.cost ? fmt::format("; costs {:.3f} m", *loss.cost) : "");
  }
  for (const std::string& assumed : exported.assumed) text += assumed + "\n";
  if (!target.caveat.empty()) text += fmt::format("{}: {}\n", target.name, target.caveat);
  return text + fmt::format("position error of the file after {} s at {} m/s: {}\n", kCostSeconds,
                            kCostSpeed, ErrorInWords(exported.cost));
}

}  // namespace trueline
