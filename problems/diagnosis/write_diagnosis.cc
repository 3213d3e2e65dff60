#include "problems/diagnosis/write_diagnosis.h"

#include <fmt/ostream.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "problems/common/atomic_file.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/witness.h"
#include "problems/effects/declaration.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node Flow(YAML::Node node) {
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node Pair(double first, double second, int digits) {
  YAML::Node node;
  node.push_back(Rounded(first, digits));
  node.push_back(Rounded(second, digits));
  return Flow(node);
}

YAML::Node Value(double value, double sigma, const std::string& unit) {
  return FlowMap({{"value", Rounded(value, 6)}, {"sigma", Rounded(sigma, 3)}, {"unit", unit}});
}

std::string UnitOf(const std::vector<EffectIndexInfo>& indices, const std::string& name) {
  const auto at = std::ranges::find(indices, name, &EffectIndexInfo::name);
  return at == indices.end() ? "1" : at->unit;
}

YAML::Node ParametersNode(const Cause& cause) {
  YAML::Node node;
  for (const auto& [name, value] : cause.candidate.fixed) {
    node[name] = FlowMap({{"value", RoundedOrWhole(value, 6)},
                          {"unit", UnitOf(cause.candidate.info->indices, name)}});
  }
  for (int i = 0; i < cause.value.size(); ++i) {
    const EffectParameterInfo& info = cause.candidate.info->parameters[i];
    node[info.name] = Value(cause.value[i], cause.sigma[i], info.unit);
  }
  return node;
}

YAML::Node GainNode(const Gain& gain, const std::string& metric, const char* count) {
  YAML::Node node;
  node["metric"] = metric;
  node["before"] = Rounded(gain.before, 4);
  node["after"] = Rounded(gain.after, 4);
  if (std::isfinite(gain.low)) {
    node["interval95"] = Pair(gain.low, gain.high, 4);
  }
  node[count] = gain.arcs;
  return node;
}

// A flight without arcs is measured by its replays only.
void AddGains(const Gains& gains, YAML::Node* node) {
  const auto& [arcs, replays] = gains;
  if (arcs.arcs > 0) (*node)["gain"] = GainNode(arcs, arcs.metric, "arcs");
  if (arcs.arcs == 0 && replays.arcs > 0) {
    (*node)["gain"] = GainNode(replays, "open_loop_error_1s", "arcs");
  }
  if (replays.arcs > 0) {
    (*node)["gain_open_loop"] = GainNode(replays, "open_loop_error_1s", "replays");
  }
}

YAML::Node RepeatNode(const Cause& cause, const Repeat& repeat) {
  YAML::Node node;
  node["log"] = repeat.log;
  node["outcome"] = repeat.outcome;
  if (repeat.value.size() == 0) return node;
  node["p_value"] = Rounded(repeat.p, 3);
  for (int i = 0; i < repeat.value.size(); ++i) {
    const EffectParameterInfo& info = cause.candidate.info->parameters[i];
    node["parameters"][info.name] = Value(repeat.value[i], repeat.sigma[i], info.unit);
  }
  return node;
}

YAML::Node SizesNode(const Cause& cause, const Eigen::VectorXd& sizes, int digits) {
  YAML::Node node;
  const EffectInfo& info = *cause.candidate.info;
  for (int i = 0; i < sizes.size(); ++i) {
    if (!Shown(info.parameters[i], cause.witness.sigma[i])) continue;
    node[info.parameters[i].name] = Rounded(sizes[i], digits);
  }
  return Flow(node);
}

YAML::Node WitnessNode(const Cause& cause) {
  const Witness& witness = cause.witness;
  YAML::Node node;
  if (!witness.stream.empty()) node["stream"] = witness.stream;
  node["says"] = witness.says;
  if (witness.value.size() > 0) {
    node["value"] = SizesNode(cause, witness.value, 4);
    node["sigma"] = SizesNode(cause, witness.sigma, 3);
  }
  node["text"] = witness.text;
  return node;
}

YAML::Node CauseNode(const Cause& cause) {
  YAML::Node node;
  node["id"] = cause.candidate.info->id;
  node["physics"] = cause.candidate.info->physics;
  if (!cause.because.empty()) node["because"] = cause.because;
  node["parameters"] = ParametersNode(cause);
  node["witness"] = WitnessNode(cause);
  if (cause.confirmed) node["confirmed"] = *cause.confirmed;
  for (const Repeat& repeat : cause.repeats) {
    node["other_flights"].push_back(RepeatNode(cause, repeat));
  }
  node["evidence"] = FlowMap({{"total", Rounded(cause.evidence.Total(), 3)},
                              {"flight", Rounded(cause.evidence.flight, 3)},
                              {"held_out", Rounded(cause.evidence.held_out, 3)},
                              {"witness", Rounded(cause.evidence.witness, 3)},
                              {"other_flights", Rounded(cause.evidence.other_flights, 3)},
                              {"prior", Rounded(cause.evidence.prior, 3)}});
  node["confidence"] = Rounded(1.0 - cause.p, 6);
  node["confused_with"] = Flow(YAML::Node(cause.confused_with));
  if (!cause.confused_with.empty()) node["separate_by"] = cause.candidate.info->separate_by;
  AddGains(cause.gains, &node);
  if (cause.agreement.arcs > 0) {
    std::string metric = "distance_from_" + cause.agreement.metric;
    std::replace(metric.begin(), metric.end(), ' ', '_');
    node["gain_agreement"] = GainNode(cause.agreement, metric, "seconds");
    node["gain_agreement"]["unit"] = cause.agreement.unit;
  }
  return node;
}

YAML::Node SizeNode(const SizeWithSigma& size) {
  return FlowMap({{"value", Rounded(size.value, 4)}, {"sigma", Rounded(size.sigma, 2)}});
}

YAML::Node TermNode(const DescribedTerm& described) {
  const TermForm& term = described.term;
  YAML::Node node;
  node["text"] = term.Text(described.size.value, described.size.sigma);
  node["enters"] = term.Enters();
  node["along"] = term.Along();
  node["goes_with"] = WordsOf(term.with);
  node["where"] = term.Where();
  node["with"] = SymbolsOf(term.with);
  node["in_model"] = described.in_model;
  node["size"] = Value(described.size.value, described.size.sigma, term.Unit());
  node["p_value"] = Rounded(described.p, 3);
  node["tried"] = described.tried;
  for (const SizeWithSigma& half : described.halves) node["halves"].push_back(SizeNode(half));
  if (!PhysicsOf(term).empty()) node["physics"] = PhysicsOf(term);
  if (!described.alike.empty()) node["fits_alike"] = described.alike;
  if (!described.instead_of.empty()) node["instead_of"] = described.instead_of;
  for (const Repeat& repeat : described.repeats) {
    YAML::Node other;
    if (repeat.value.size() > 0) other = SizeNode({repeat.value[0], repeat.sigma[0]});
    other["log"] = repeat.log;
    other["outcome"] = repeat.outcome;
    node["other_flights"].push_back(other);
  }
  return node;
}

YAML::Node CandidateNode(const CandidateReport& report) {
  YAML::Node node;
  node["id"] = report.id;
  if (report.label != report.id) node["which"] = report.label;
  node["score_z"] = Rounded(report.z, 4);
  node["p_value"] = Rounded(report.p, 4);
  for (int i = 0; i < report.value.size(); ++i) {
    const std::string& name = report.parameters()[i].name;
    node["estimate"][name] = Rounded(report.value[i], 3);
    node["sigma"][name] = Rounded(report.sigma[i], 2);
    node["detectable_size"][name] = Rounded(report.detectable[i], 3);
  }
  return Flow(node);
}

YAML::Node AxesNode(const Eigen::Vector3d& before, const Eigen::Vector3d& after,
                    const std::array<const char*, 3>& names) {
  YAML::Node node;
  for (int i = 0; i < 3; ++i) {
    node[names[i]] = Pair(before[i], after[i], 3);
  }
  return Flow(node);
}

// Open-loop errors [before, after] and the variables correlated with them.
YAML::Node MisfitNode(const Misfit& misfit) {
  YAML::Node node;
  node["measured_by"] = misfit.measured_by;
  for (const MisfitGrowth& g : misfit.growth) {
    YAML::Node row;
    row["horizon_s"] = Rounded(g.horizon, 3);
    row["replays"] = g.replays;
    row["rms_earth_m"] = AxesNode(g.before_E, g.after_E, {"north", "east", "down"});
    row["rms_body_m"] = AxesNode(g.before_B, g.after_B, {"forward", "right", "down"});
    node["growth"].push_back(row);
  }
  node["shares_horizon_s"] = Rounded(misfit.shares_horizon, 3);
  for (const MisfitShare& share : misfit.shares) {
    node["share_of_variance"].push_back(FlowMap({{"by", share.by},
                                                 {"body", Rounded(share.body, 2)},
                                                 {"earth", Rounded(share.earth, 2)},
                                                 {"p_value", Rounded(share.p, 2)}}));
  }
  return node;
}

// The content that --model takes: the vehicle's parameters, and effects beyond eq. 15.
YAML::Node ModelNode(const Diagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  for (const ParameterEstimate& p : diagnosis.parameters) {
    node["parameters"][p.name] = Value(p.value, p.sigma, p.unit);
  }
  node["effects"] = EffectsNode(diagnosis.in_model);
  node["provenance"] = provenance;
  return node;
}

void WriteResiduals(const Diagnosis& diagnosis, const std::filesystem::path& path) {
  WriteCsv(path,
           "t [s],kind,gate [1],x_before [1],y_before [1],z_before [1],x_after [1],y_after "
           "[1],z_after [1]",
           [&](std::ostream& out) {
             for (std::size_t i = 0; i < diagnosis.after.rows.size(); ++i) {
               const Residuals::Row& r = diagnosis.after.rows[i];
               const Eigen::Vector3d &before = diagnosis.before.rows[i].sigmas, &after = r.sigmas;
               fmt::print(out, "{:.6f},{},{},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}\n", r.t,
                          r.kind, r.gate, before.x(), before.y(), before.z(), after.x(), after.y(),
                          after.z());
             }
           });
}

// All terms of the open catalogue, tested singly.
void WriteTerms(const std::vector<TermSize>& terms, const std::filesystem::path& path) {
  WriteCsv(path, "term,unit,size,sigma,p_value [1]", [&](std::ostream& out) {
    for (const TermSize& t : terms) {
      fmt::print(out, "{},{},{:.4g},{:.3g},{:.3g}\n", CsvField(t.name), t.unit, t.size.value,
                 t.size.sigma, t.p);
    }
  });
}

std::string Axes(const ReplayError& replay) {
  return fmt::format("{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}", replay.error_E.x(),
                     replay.error_E.y(), replay.error_E.z(), replay.error_B.x(), replay.error_B.y(),
                     replay.error_B.z());
}

void WriteMisfit(const Misfit& misfit, const std::filesystem::path& path) {
  std::string header = "t [s],horizon [s]";
  for (const char* when : {"before", "after"}) {
    for (const char* axis : {"north", "east", "down", "forward", "right", "below"}) {
      header += fmt::format(",{}_{} [m]", axis, when);
    }
  }
  header +=
      ",time [s],speed [m/s],acceleration [m/s^2],thrust [m/s^2],rate [rad/s],heading "
      "[rad],gate [1],gate_distance [m],height [m],battery [V],x [m],y [m]";
  const auto number = [](double v) { return std::isfinite(v) ? fmt::format("{:.5g}", v) : ""; };
  WriteCsv(path, header, [&](std::ostream& out) {
    for (const MisfitRow& r : misfit.rows) {
      fmt::print(out, "{:.6f},{:.4g},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                 ToSeconds(r.before.end), r.before.horizon, Axes(r.before), Axes(r.after),
                 number(r.at.time), number(r.at.speed), number(r.at.acceleration),
                 number(r.at.thrust), number(r.at.rate), number(r.at.heading), r.at.gate,
                 number(r.at.gate_distance), number(r.at.height), number(r.at.battery),
                 number(r.at.north), number(r.at.east));
    }
  });
}

}  // namespace

YAML::Node DiagnosisNode(const Diagnosis& diagnosis, const YAML::Node& provenance) {
  YAML::Node node;
  node["verdict"] = diagnosis.verdict;
  node["meaning"] = VerdictMeaning(diagnosis);
  node["next"] = NextSteps(diagnosis);
  if (!diagnosis.log_faults.empty()) node["log_faults"] = diagnosis.log_faults;
  if (!diagnosis.drive.empty()) node["drive"] = diagnosis.drive;
  node["causes"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Cause& cause : diagnosis.causes) node["causes"].push_back(CauseNode(cause));
  for (const Cause& cause : diagnosis.set_aside) node["set_aside"].push_back(CauseNode(cause));
  AddGains(diagnosis.gains, &node);
  if (!diagnosis.model_lacks.empty()) node["model_lacks"] = diagnosis.model_lacks;
  if (!diagnosis.unexplained_by.empty()) node["goes_with"] = diagnosis.unexplained_by;
  for (const DescribedTerm& term : diagnosis.open.described)
    node["terms"].push_back(TermNode(term));
  if (diagnosis.terms_gains.arcs.arcs + diagnosis.terms_gains.replays.arcs > 0) {
    YAML::Node gains;
    AddGains(diagnosis.terms_gains, &gains);
    node["terms_gain"] = gains;
  }
  if (!diagnosis.against.empty()) node["against"] = diagnosis.against;
  node["evidence_needed"] = Rounded(diagnosis.evidence_needed, 3);
  node["not_shown"] = Flow(YAML::Node(diagnosis.not_shown));
  node["candidates"] = YAML::Node(YAML::NodeType::Sequence);
  for (const CandidateReport& c : diagnosis.candidates) {
    node["candidates"].push_back(CandidateNode(c));
  }
  node["residual"] = FlowMap({{"rms_before", Rounded(diagnosis.before.rms, 4)},
                              {"rms_after", Rounded(diagnosis.after.rms, 4)},
                              {"unit", "sigma"},
                              {"white", diagnosis.after.whiteness_p > 0.01 ? "true" : "false"},
                              {"whiteness_p", Rounded(diagnosis.after.whiteness_p, 3)},
                              {"whiteness_p_before", Rounded(diagnosis.before.whiteness_p, 3)}});
  if (diagnosis.misfit) node["misfit"] = MisfitNode(*diagnosis.misfit);
  node["noise"] = diagnosis.noise;
  if (diagnosis.rotor_delay) node["rotor_delay"] = *diagnosis.rotor_delay;
  if (diagnosis.gyro_delay) node["gyro_delay"] = *diagnosis.gyro_delay;
  if (!diagnosis.fixes.empty()) node["fixes"] = diagnosis.fixes;
  node["warnings"] = diagnosis.warnings;
  node["provenance"] = provenance;
  return node;
}

void WriteDiagnosis(const Diagnosis& diagnosis, const YAML::Node& result,
                    const std::filesystem::path& directory) {
  WriteFileAtomically(directory / "model.yaml", TextOf(ModelNode(diagnosis, result["provenance"])));
  WriteResiduals(diagnosis, directory / "residuals.csv");
  WriteTerms(diagnosis.open.tested, directory / "terms.csv");
  if (diagnosis.misfit) WriteMisfit(*diagnosis.misfit, directory / "misfit.csv");
  WriteFileAtomically(directory / "diagnosis.yaml", TextOf(result));
}

}  // namespace trueline
