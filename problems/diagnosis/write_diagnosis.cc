#include "problems/diagnosis/write_diagnosis.h"

#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "problems/common/atomic_file.h"

namespace trueline {
namespace {

double Round(double value, int digits) {  // significant digits, for people who read the YAML
  return std::stod(fmt::format("{:.{}g}", value, digits));
}

YAML::Node Flow(YAML::Node node) {
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node Value(double value, double sigma, const std::string& unit) {
  YAML::Node node;
  node["value"] = Round(value, 6);
  node["sigma"] = Round(sigma, 3);
  node["unit"] = unit;
  return Flow(node);
}

YAML::Node ParametersNode(const Cause& cause) {
  YAML::Node node;
  for (const auto& [name, value] : cause.candidate.fixed) {
    YAML::Node fixed;
    fixed["value"] = Round(value, 6);
    fixed["unit"] = name == "t_step" ? "s" : name == "rotor" ? "index" : "id";
    node[name] = Flow(fixed);
  }
  for (int i = 0; i < cause.value.size(); ++i) {
    const EffectParameterInfo& info = cause.candidate.info->parameters[i];
    node[info.name] = Value(cause.value[i], cause.sigma[i], info.unit);
  }
  return node;
}

YAML::Node GainNode(const Gain& gain) {
  YAML::Node node;
  node["metric"] = gain.metric;
  node["before"] = Round(gain.before, 4);
  node["after"] = Round(gain.after, 4);
  node["interval95"].push_back(Round(gain.low, 4));
  node["interval95"].push_back(Round(gain.high, 4));
  node["interval95"].SetStyle(YAML::EmitterStyle::Flow);
  node["arcs"] = gain.arcs;
  return node;
}

}  // namespace

YAML::Node CauseNode(const Cause& cause) {
  YAML::Node node;
  node["id"] = cause.candidate.info->id;
  node["parameters"] = ParametersNode(cause);
  node["confidence"] = Round(1.0 - cause.p, 6);
  node["confused_with"] = cause.confused_with;
  node["confused_with"].SetStyle(YAML::EmitterStyle::Flow);
  if (!cause.confused_with.empty()) node["separate_by"] = cause.candidate.info->separate_by;
  if (cause.gain.arcs > 0) node["gain"] = GainNode(cause.gain);
  return node;
}

YAML::Node CandidateNode(const CandidateReport& report) {
  YAML::Node node;
  node["id"] = report.id;
  if (report.label != report.id) node["which"] = report.label;
  node["score_z"] = Round(report.z, 4);
  node["p_value"] = Round(report.p, 4);
  for (std::size_t i = 0; i < report.parameters.size(); ++i) {
    node["detectable_size"][report.parameters[i]] = Round(report.detectable[i], 3);
  }
  return Flow(node);
}

YAML::Node EffectsNode(const std::vector<Cause>& causes) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const Cause& cause : causes) {
    YAML::Node effect;
    effect["id"] = cause.candidate.info->id;
    for (const auto& [name, value] : cause.effect().values) effect[name] = Round(value, 6);
    node.push_back(Flow(effect));
  }
  if (causes.empty()) node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

namespace {

// What the model leaves out, as learned with the causes in it.
YAML::Node NoiseNode(const NoiseStrengths& noise) {
  YAML::Node node;
  node["fix_scale"] = Round(noise.fix_scale, 3);
  node["force_sigma_mps2"] = Round(noise.force_sigma, 3);
  node["gust_mps2"] = Round(noise.gust, 3);
  node["gust_memory_s"] = Round(noise.gust_memory, 3);
  node["acceleration_mps2_per_sqrt_hz"] = Round(noise.process.acceleration, 3);
  node["tilt_deg"] = Round(noise.process.tilt / kDegree, 3);
  node["heading_deg"] = Round(noise.process.heading / kDegree, 3);
  node["memory_s"] = Round(noise.process.memory, 3);
  return Flow(node);
}

YAML::Node DiagnosisNode(const Diagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  node["verdict"] = diagnosis.verdict;
  node["causes"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Cause& cause : diagnosis.causes) node["causes"].push_back(CauseNode(cause));
  if (!diagnosis.unexplained_by.empty()) node["goes_with"] = diagnosis.unexplained_by;
  node["candidates"] = YAML::Node(YAML::NodeType::Sequence);
  for (const CandidateReport& c : diagnosis.candidates) {
    node["candidates"].push_back(CandidateNode(c));
  }
  YAML::Node residual;
  residual["rms_before"] = Round(diagnosis.rms_before, 4);
  residual["rms_after"] = Round(diagnosis.rms_after, 4);
  residual["unit"] = "sigma";
  residual["white"] = diagnosis.whiteness_p > 0.01;
  residual["whiteness_p"] = Round(diagnosis.whiteness_p, 3);
  node["residual"] = Flow(residual);
  node["noise"] = NoiseNode(diagnosis.noise);
  node["warnings"] = diagnosis.warnings;
  node["provenance"] = provenance;
  return node;
}

// What every --model flag takes: the vehicle, and the effects beyond eq. 15.
YAML::Node ModelNode(const Diagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  for (const ModelParameter& p : diagnosis.parameters) {
    node["parameters"][p.name] = Value(p.value, p.sigma, p.unit);
  }
  node["effects"] = EffectsNode(diagnosis.causes);
  node["provenance"] = provenance;
  return node;
}

std::string Emit(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetDoublePrecision(12);
  emitter << node;
  return std::string(emitter.c_str()) + "\n";
}

void WriteResiduals(const Diagnosis& diagnosis, const std::filesystem::path& path) {
  AtomicFile file(path);
  fmt::print(file.stream(),
             "t [s],kind,gate [1],x_before [1],y_before [1],z_before [1],x_after [1],y_after "
             "[1],z_after [1]\n");
  for (const RowReport& r : diagnosis.rows) {
    fmt::print(file.stream(), "{:.6f},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n",
               ToSeconds(r.t), r.fix ? "fix" : "force", r.gate, r.before.x(), r.before.y(),
               r.before.z(), r.after.x(), r.after.y(), r.after.z());
  }
  file.Commit();
}

std::string Sizes(const CandidateReport& c, const Eigen::VectorXd& values) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    texts.push_back(fmt::format("{} {:.2g}", c.parameters[i], values[static_cast<int>(i)]));
  }
  return fmt::format("{} {}", fmt::join(texts, ", "), c.units.front());
}

}  // namespace

std::string CauseText(const Cause& cause) {
  std::string text = fmt::format("  {}: ", cause.candidate.Label());
  for (int i = 0; i < cause.value.size(); ++i) {
    const EffectParameterInfo& info = cause.candidate.info->parameters[i];
    text += fmt::format("{} = {:.4g} +- {:.2g} {}  ", info.name, cause.value[i], cause.sigma[i],
                        info.unit);
  }
  text += fmt::format("(p {:.1g})\n    {}\n", cause.p, cause.candidate.info->physics);
  if (!cause.confused_with.empty()) {
    text += fmt::format("    as good on this flight: {}; to tell them apart: {}\n",
                        fmt::join(cause.confused_with, ", "), cause.candidate.info->separate_by);
  }
  return text;
}

std::string CandidateLines(const std::vector<CandidateReport>& candidates) {
  std::string table = fmt::format("{:<26}{:>8}{:>10}  {:<48}{}\n", "candidate", "score z", "p",
                                  "estimate", "would have been found from");
  for (const CandidateReport& c : candidates) {
    table += fmt::format("{:<26}{:>8.1f}{:>10.2g}  {:<48}{}\n", c.label, c.z, c.p,
                         Sizes(c, c.value), Sizes(c, c.detectable));
  }
  return table;
}

void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& provenance,
                    const std::filesystem::path& directory) {
  WriteFileAtomically(directory / "model.yaml", Emit(ModelNode(diagnosis, provenance)));
  WriteResiduals(diagnosis, directory / "residuals.csv");
  WriteFileAtomically(directory / "diagnosis.yaml", Emit(DiagnosisNode(diagnosis, provenance)));
}

std::string DiagnosisTable(const Diagnosis& diagnosis) {
  std::string table = CandidateLines(diagnosis.candidates);
  table += fmt::format("\nverdict: {}\n", diagnosis.verdict);
  for (const Cause& cause : diagnosis.causes) table += CauseText(cause);
  for (const std::string& what : diagnosis.unexplained_by) table += "  goes with " + what + "\n";
  if (!diagnosis.causes.empty() && diagnosis.causes[0].gain.arcs > 0) {
    const Gain& gain = diagnosis.causes[0].gain;
    table += fmt::format(
        "  final-point error on {} held-out arcs: {:.3f} m before, {:.3f} m after (95 % of the "
        "gain: {:.3f} to {:.3f} m)\n",
        gain.arcs, gain.before, gain.after, gain.low, gain.high);
  }
  table += fmt::format("residual of fixes: {:.2f} sigma before, {:.2f} after\n",
                       diagnosis.rms_before, diagnosis.rms_after);
  return table;
}

}  // namespace trueline
