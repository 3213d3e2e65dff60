#include "problems/rotor_diagnosis/write_rotor_diagnosis.h"

#include <fmt/ostream.h>

#include "problems/common/atomic_file.h"
#include "problems/diagnosis/write_diagnosis.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node ResidualNode(const RotorDiagnosis& diagnosis) {
  YAML::Node node;
  node["rms_before"] = Rounded(diagnosis.rms_before, 4);
  node["rms_after"] = Rounded(diagnosis.rms_after, 4);
  node["unit"] = "sigma";
  node["white"] = diagnosis.whiteness_p > 0.01;
  node["whiteness_p"] = Rounded(diagnosis.whiteness_p, 3);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node DiagnosisNode(const RotorDiagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  node["verdict"] = diagnosis.verdict;
  node["drive"] = "rotors";
  node["causes"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Cause& cause : diagnosis.causes) node["causes"].push_back(CauseNode(cause));
  if (!diagnosis.unexplained_by.empty()) node["goes_with"] = diagnosis.unexplained_by;
  node["candidates"] = YAML::Node(YAML::NodeType::Sequence);
  for (const CandidateReport& c : diagnosis.candidates) {
    node["candidates"].push_back(CandidateNode(c));
  }
  node["residual"] = ResidualNode(diagnosis);
  node["noise"] = ToYaml(diagnosis.noise);
  node["rotor_delay"] = diagnosis.rotor_delay;
  node["warnings"] = diagnosis.warnings;
  node["provenance"] = provenance;
  return node;
}

YAML::Node ModelNode(const RotorDiagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  for (const ParameterEstimate& p : diagnosis.parameters) {
    YAML::Node entry;
    entry["value"] = Rounded(p.value, 6);
    entry["sigma"] = Rounded(p.sigma, 3);
    entry["unit"] = p.unit;
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node["parameters"][p.name] = entry;
  }
  node["effects"] = EffectsNode(diagnosis.causes);
  node["provenance"] = provenance;
  return node;
}

// Same rows as the IMU-driven diagnosis: force and angular acceleration for each pose interval.
void WriteResiduals(const RotorDiagnosis& diagnosis, const std::filesystem::path& path) {
  AtomicFile file(path);
  fmt::print(file.stream(),
             "t [s],kind,gate [1],x_before [1],y_before [1],z_before [1],x_after [1],y_after "
             "[1],z_after [1]\n");
  for (const RotorRow& r : diagnosis.rows) {
    for (const int first : {0, 3}) {
      fmt::print(file.stream(), "{:.6f},{},-1,{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n", r.t,
                 first == 0 ? "specific_force" : "angular_acceleration", r.before[first],
                 r.before[first + 1], r.before[first + 2], r.after[first], r.after[first + 1],
                 r.after[first + 2]);
    }
  }
  file.Commit();
}

}  // namespace

void WriteRotorDiagnosis(const RotorDiagnosis& diagnosis, const YAML::Node& provenance,
                         const std::filesystem::path& directory) {
  WriteFileAtomically(directory / "model.yaml", TextOf(ModelNode(diagnosis, provenance)));
  WriteResiduals(diagnosis, directory / "residuals.csv");
  WriteFileAtomically(directory / "diagnosis.yaml", TextOf(DiagnosisNode(diagnosis, provenance)));
}

std::string RotorDiagnosisTable(const RotorDiagnosis& diagnosis) {
  std::string table = CandidateLines(diagnosis.candidates);
  table += fmt::format("\nverdict: {}\n", diagnosis.verdict);
  for (const Cause& cause : diagnosis.causes) table += CauseText(cause);
  for (const std::string& what : diagnosis.unexplained_by) table += "  goes with " + what + "\n";
  table += fmt::format("disturbances between poses: {:.2f} sigma before, {:.2f} after\n",
                       diagnosis.rms_before, diagnosis.rms_after);
  return table;
}

}  // namespace trueline
