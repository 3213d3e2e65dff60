#include <fmt/format.h>
#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include <cmath>

#include "problems/against/comparison.h"
#include "problems/common/atomic_file.h"
#include "problems/result/statistics.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

constexpr double kPower95 = 1.645;  // sigmas

constexpr char kSeparateRotor[] =
    "weigh the vehicle, and fly it without the load: a weak rotor stays weak; or change the "
    "propeller";
constexpr char kSeparateScale[] = "weigh the vehicle and state its mass in each log (vehicle.mass)";

// The channels as their columns are named, numbered from 1.
std::string NameOf(const Comparison& comparison, const TriedCause& cause) {
  if (cause.channels.empty()) return "all";
  std::vector<std::string> names;
  for (const int k : cause.channels) {
    names.push_back(fmt::format("{}{}", comparison.flight.is_speed ? "w" : "u", k + 1));
  }
  return fmt::format("{}", fmt::join(names, "+"));
}

std::string Percent(double value, double sigma) {
  return fmt::format("{:.1f} +- {:.1f} %", 100.0 * value, 100.0 * sigma);
}

// k_f of a rotor, or of all, as a factor: the command is 1/factor times as large.
double FactorOf(const TriedCause& cause, Eigen::Index i) { return std::exp(-cause.size[i]); }

std::string Statement(const Comparison& comparison, const TriedCause& cause) {
  std::vector<std::string> parts;
  for (Eigen::Index i = 0; i < cause.size.size(); ++i) {
    const double factor = FactorOf(cause, i);
    const std::string who =
        cause.channels.empty()
            ? "the rotors together give"
            : fmt::format("u{} gives", cause.channels[static_cast<std::size_t>(i)] + 1);
    parts.push_back(fmt::format("{} {} {} thrust for the same command", who,
                                Percent(std::abs(1.0 - factor), factor * cause.sigma[i]),
                                factor < 1.0 ? "less" : "more"));
  }
  const AlikeLoad load = comparison.LoadOf(cause);
  const std::string amount = Percent(std::abs(load.share), load.sigma);
  std::string other;
  if (!cause.channels.empty()) {
    other = fmt::format("a load of {} of the vehicle's mass hangs under {}", amount,
                        NameOf(comparison, cause));
  } else if (load.share > 0.0) {
    other = fmt::format("the vehicle carries {} more than {}, or the command has another unit",
                        amount, comparison.by_mass ? "the logs state" : "before");
  } else {
    other = fmt::format("the vehicle is {} lighter than {}, or the command has another unit",
                        amount, comparison.by_mass ? "the logs state" : "before");
  }
  return fmt::format("{}, or {}", fmt::join(parts, " and "), other);
}

YAML::Node Value(double value, double sigma, const char* unit) {
  return FlowMap({{"value", Rounded(value, 4)}, {"sigma", Rounded(sigma, 2)}, {"unit", unit}});
}

YAML::Node Flow(YAML::Node node) {
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

// By Student's t with `dof` degrees of freedom.
YAML::Node Interval95(double value, double sigma, double dof) {
  const double half = sigma * std::sqrt(FCritical(0.05, 1.0, dof));
  YAML::Node node;
  node.push_back(Rounded(value - half, 4));
  node.push_back(Rounded(value + half, 4));
  return Flow(node);
}

YAML::Node LoadNode(const Comparison& comparison, const TriedCause& cause) {
  const AlikeLoad load = comparison.LoadOf(cause);
  YAML::Node node;
  node["id"] = "payload";
  node["under"] = NameOf(comparison, cause);
  node["parameters"]["share_of_mass"] = Value(load.share, load.sigma, "1");
  if (const auto mass = comparison.flight.mass) {
    node["parameters"]["mass"] = Value(load.share * *mass, load.sigma * *mass, "kg");
  }
  return node;
}

// What all causes of one tried change share.
void AddShared(const Comparison& comparison, const TriedCause& cause, const Findings& findings,
               YAML::Node* node) {
  std::vector<std::string> alike = {"payload"};
  for (const TriedCause& other : findings.alike) {
    if (other.id != cause.id) alike.push_back(other.id);
  }
  (*node)["confidence"] = Rounded(1.0 - cause.p, 6);
  (*node)["evidence"] =
      FlowMap({{"total", Rounded(cause.evidence, 4)}, {"flight", Rounded(cause.evidence, 4)}});
  (*node)["confused_with"] = Flow(YAML::Node(alike));
  (*node)["alternatives"].push_back(LoadNode(comparison, cause));
  for (const TriedCause& other : findings.alike) {
    (*node)["alternatives"].push_back(FlowMap({{"id", other.id},
                                               {"which", NameOf(comparison, other)},
                                               {"evidence", Rounded(other.evidence, 4)}}));
  }
  (*node)["separate_by"] = cause.channels.empty() ? kSeparateScale : kSeparateRotor;
  (*node)["text"] = Statement(comparison, cause);
}

// A cause for each rotor of a change.
YAML::Node CausesNode(const Comparison& comparison, const Findings& findings,
                      const TriedCause& cause) {
  YAML::Node causes(YAML::NodeType::Sequence);
  for (Eigen::Index i = 0; i < cause.size.size(); ++i) {
    YAML::Node node;
    node["id"] = cause.id;
    const double factor = FactorOf(cause, i);
    const double sigma = factor * cause.sigma[i];
    // Two flights of one session differ by the scatter of both.
    const double repeat = factor * cause.sigma_flight[i] * std::sqrt(2.0);
    const bool is_scale = cause.channels.empty();
    const double value = is_scale ? factor - 1.0 : factor;
    if (!is_scale) {
      const int channel = cause.channels[static_cast<std::size_t>(i)];
      node["parameters"]["rotor"] =
          FlowMap({{"value", std::to_string(channel)}, {"unit", "index"}});
      node["column"] = fmt::format("{}{}", comparison.flight.is_speed ? "w" : "u", channel + 1);
    }
    node["parameters"][is_scale ? "s" : "factor"] = Value(value, sigma, "1");
    node["interval95"] = Interval95(value, sigma, comparison.forecast.dof);
    node["repeats95"] = Interval95(value, repeat, comparison.references.within.dof);
    AddShared(comparison, cause, findings, &node);
    causes.push_back(node);
  }
  return causes;
}

YAML::Node CandidateNode(const Comparison& comparison, const TriedCause& cause) {
  YAML::Node node;
  node["id"] = cause.id;
  node["which"] = NameOf(comparison, cause);
  node["evidence"] = Rounded(cause.evidence, 4);
  node["score_z"] = Rounded(std::sqrt(2.0 * cause.evidence), 3);
  node["p_value"] = Rounded(cause.p, 3);
  const char* name = cause.channels.empty() ? "s" : "factor";
  const double needed = comparison.SigmasNeeded();
  for (Eigen::Index i = 0; i < cause.size.size(); ++i) {
    const double factor = FactorOf(cause, i);
    const double shown = std::exp(-(needed + kPower95) * cause.sigma[i]);
    const double less = cause.channels.empty() ? 1.0 : 0.0;
    node["estimate"][name].push_back(Rounded(factor - less, 4));
    node["sigma"][name].push_back(Rounded(factor * cause.sigma[i], 2));
    node["sigma_flight"][name].push_back(Rounded(factor * cause.sigma_flight[i], 2));
    node["detectable_size"][name].push_back(Rounded(shown - less, 3));
  }
  return Flow(node);
}

std::string SessionText(const Comparison& comparison) {
  const References& references = comparison.references;
  const double within = 100.0 * references.within.OfOneChannel();
  if (comparison.session == SessionOfFlight::kSame) {
    return fmt::format(
        "--session=same: the flight is of a session of the references; within one a command "
        "scatters by {:.1f} %",
        within);
  }
  const double between = 100.0 * references.between.OfOneChannel();
  if (references.between_is_usual) {
    return fmt::format(
        "all references are of one session, so how sessions of this vehicle differ is not known: "
        "intervals hold the usual {:.1f} % of a command. If the flight is of that session, too "
        "(one day, nothing rebuilt), --session=same compares within it, to {:.1f} %",
        between, within);
  }
  return fmt::format(
      "the references are of {} sessions, between which a command differs by {:.1f} %, and by "
      "{:.1f} % within one; intervals hold both",
      references.sessions(), between, within);
}

YAML::Node ScatterNode(const TrimScatter& scatter) {
  return FlowMap({{"common", Rounded(scatter.common, 3)}, {"own", Rounded(scatter.own, 3)}});
}

YAML::Node ReferencesNode(const Comparison& comparison) {
  const References& references = comparison.references;
  YAML::Node node;
  node["flights"] = references.flights;
  node["sessions"] = references.sessions();
  node["text"] = SessionText(comparison);
  node["sigma_within"] = ScatterNode(references.within);
  node["sigma_between"] = ScatterNode(references.between);
  node["sigma_between_is_usual"] = references.between_is_usual;
  if (references.ln_voltage) {
    node["by_voltage"] = Value(references.slope, references.slope_sigma, "1");
  }
  return node;
}

YAML::Node ByAxis(const Eigen::Vector3d& values) {
  return FlowMap({{"roll", Rounded(values[0], 3)},
                  {"pitch", Rounded(values[1], 3)},
                  {"yaw", Rounded(values[2], 3)}});
}

YAML::Node ResponseNode(const CommandResponse& response) {
  YAML::Node node;
  node["delay"] = FlowMap({{"value", Rounded(response.delay, 3)}, {"unit", "s"}});
  node["motor_lag"] = FlowMap({{"value", Rounded(response.lag, 3)}, {"unit", "s"}});
  node["explained"] = ByAxis(response.explained);
  node["explained_without_trim"] = ByAxis(response.explained_without_trim);
  return node;
}

std::string ResponseText(const CommandResponse& response) {
  const Eigen::Vector3d percent = 100.0 * response.explained;
  return fmt::format(
      "by the references' response to commands (delay {:.2f} s, motor lag {:.3g} s) this flight's "
      "angular acceleration is explained by {:.0f} % in roll, {:.0f} % in pitch, {:.0f} % in yaw\n",
      response.delay, response.lag, percent[0], percent[1], percent[2]);
}

YAML::Node ComparisonNode(const Comparison& comparison, const YAML::Node& provenance) {
  const Findings& findings = comparison.findings;
  YAML::Node node;
  node["verdict"] = comparison.verdict;
  if (!comparison.log_faults.empty()) node["log_faults"] = comparison.log_faults;
  node["drive"] = "commands";
  for (const CommandTrim& other : comparison.others) node["against"].push_back(other.log);
  const auto causes = [&](const Findings& of) {
    return of.named ? CausesNode(comparison, of, *of.named) : YAML::Node(YAML::NodeType::Sequence);
  };
  node["causes"] = causes(findings);
  // What stands first, though the evidence may not suffice to name it, or all of it.
  node["first"] = CausesNode(comparison, findings, findings.tried.front());
  if (comparison.session == SessionOfFlight::kUnknown) {
    node["if_same_session"] = causes(comparison.if_same_session);
  }
  node["evidence_needed"] = Rounded(comparison.EvidenceNeeded(), 4);
  for (const TriedCause& cause : findings.tried) {
    node["candidates"].push_back(CandidateNode(comparison, cause));
  }
  node["misfit_p"] = Rounded(findings.misfit_p, 3);
  node["references"] = ReferencesNode(comparison);
  if (comparison.response) node["response"] = ResponseNode(*comparison.response);
  node["warnings"] = comparison.warnings;
  node["provenance"] = provenance;
  return node;
}

std::string TrimRow(const CommandTrim& trim, int session) {
  std::string row = fmt::format("{},{},{:.2f},", CsvField(trim.log), session, trim.seconds);
  if (trim.voltage) row += fmt::format("{:.4g}", *trim.voltage);
  for (Eigen::Index k = 0; k < trim.command.size(); ++k) {
    row += fmt::format(",{:.5g},{:.2g},{:.3g}", trim.command[k], trim.command[k] * trim.sigma[k],
                       trim.saturated[k]);
  }
  return row;
}

}  // namespace

void WriteTrims(const Comparison& comparison, const std::filesystem::path& path) {
  std::string header = "log,session [1],steady [s],battery [V]";
  for (int k = 1; k <= comparison.flight.channels(); ++k) {
    header += fmt::format(",u{0} [1],sigma_u{0} [1],saturated_u{0} [1]", k);
  }
  WriteCsv(path, header, [&](std::ostream& out) {
    fmt::print(out, "{}\n", TrimRow(comparison.flight, -1));
    for (std::size_t i = 0; i < comparison.others.size(); ++i) {
      fmt::print(out, "{}\n", TrimRow(comparison.others[i], comparison.references.session_of[i]));
    }
  });
}

void WriteComparison(const Comparison& comparison, const YAML::Node& provenance,
                     const std::filesystem::path& directory) {
  WriteTrims(comparison, directory / "trims.csv");
  WriteFileAtomically(directory / "diagnosis.yaml", TextOf(ComparisonNode(comparison, provenance)));
}

void AddComparison(const Comparison& comparison, YAML::Node* diagnosis) {
  YAML::Node trim = ComparisonNode(comparison, YAML::Node());
  for (const YAML::Node& cause : trim["causes"])
    (*diagnosis)["causes"].push_back(YAML::Clone(cause));
  const std::vector<std::string> verdicts = {"clean", "explained", "ambiguous", "unexplained"};
  const auto rank = [&](const YAML::Node& of) {
    return std::ranges::find(verdicts, of["verdict"].as<std::string>());
  };
  (*diagnosis)["verdict"] = *std::max(rank(*diagnosis), rank(trim));
  for (const char* key : {"drive", "against", "provenance"}) trim.remove(key);
  (*diagnosis)["trim"] = trim;
}

std::string ComparisonTable(const Comparison& comparison) {
  const Findings& findings = comparison.findings;
  const TriedCause& best = findings.tried.front();
  std::string table = fmt::format("verdict: {}\n", comparison.verdict);
  if (findings.named) {
    table += Statement(comparison, *findings.named) + "\n";
  } else if (best.Score() > 0.0) {
    table += fmt::format("nothing is named; first would be: {} (evidence {:.1f} of {:.1f})\n",
                         Statement(comparison, best), best.evidence, comparison.EvidenceNeeded());
  }
  const std::optional<TriedCause>& same = comparison.if_same_session.named;
  if (comparison.session == SessionOfFlight::kUnknown && !findings.named && same) {
    table += fmt::format("if the flight is of the references' session: {}\n",
                         Statement(comparison, *same));
  }
  table += SessionText(comparison) + "\n";
  if (comparison.response) table += ResponseText(*comparison.response);
  table += "\n";
  const bool is_speed = comparison.flight.is_speed;
  table += fmt::format("{:<9}{:>11}{:>12}{:>12}{:>12}\n", is_speed ? "speed^2" : "command", "mean",
                       "expected", "change", "sigma");
  const Eigen::VectorXd change = comparison.ln_command - comparison.forecast.mean;
  for (Eigen::Index k = 0; k < change.size(); ++k) {
    const double mean = comparison.flight.command[k];
    table += fmt::format("{:<9}{:>11.4g}{:>12.4g}{:>10.1f} %{:>10.1f} %\n",
                         fmt::format("{}{}", is_speed ? "w" : "u", k + 1), mean,
                         mean * std::exp(-change[k]), 100.0 * std::expm1(change[k]),
                         100.0 * std::sqrt(comparison.forecast.cov(k, k)));
  }
  return table;
}

}  // namespace trueline
