#include "problems/calibration/write_calibration.h"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <string_view>

#include "cost_functions/models/imu_driven_model.h"
#include "cost_functions/models/rotor_constants.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/effects/declaration.h"
#include "problems/log/csv_text.h"
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
    text += fmt::format("  this flight does not show a change of {}\n", combination);
  }
  return text;
}

std::string VerdictText(const Verdict& verdict) {
  std::string text = fmt::format("\nverdict: {}\n", verdict.word);
  for (const std::string& reason : verdict.reasons) text += "  " + reason + "\n";
  return text;
}

namespace {

void ForEachWindow(const Calibration& calibration,
                   const std::function<void(const EstimatorRun&, const WindowEstimate&)>& visit) {
  for (const EstimatorRun& run : calibration.runs) {
    for (const WindowEstimate& window : run.windows) visit(run, window);
  }
}

void WriteArcRow(std::ostream& out, const std::string& log, const EstimatorRun& run,
                 const WindowEstimate& w) {
  const ArcPrediction& arc = *w.arc;
  const Eigen::Matrix2d cov = arc.EndCov();
  const bool truth = arc.truth.has_value();
  fmt::print(
      out, "{},{},{},{},{},{},{},{:.6g},{},{:.6g},{},{},{:.6g},{:.6g},{},{},{:.6g},{:.6g},{:.6g}\n",
      log, run.estimator, run.gamma, w.tau, TimeText(arc.begin), TimeText(arc.end),
      truth ? fmt::format("{:.6g}", arc.FinalPointError()) : "", arc.PredictedSigma(), w.iterations,
      w.solve_time, arc.truth_source, truth ? fmt::format("{}", int(arc.Inside95())) : "",
      arc.p_E.x(), arc.p_E.y(), truth ? fmt::format("{:.6g}", arc.truth->x()) : "",
      truth ? fmt::format("{:.6g}", arc.truth->y()) : "", cov(0, 0), cov(0, 1), cov(1, 1));
}

void WriteArcs(const Calibration& calibration, const std::string& log,
               const std::filesystem::path& path) {
  WriteCsv(path,
           "log,estimator,gamma,tau,t_start [s],t_end [s],final_point_error [m],predicted_sigma "
           "[m],iterations [1],solve_time [s],truth,inside_95 [1],x_predicted [m],y_predicted "
           "[m],x_truth [m],y_truth [m],cov_xx [m^2],cov_xy [m^2],cov_yy [m^2]",
           [&](std::ostream& out) {
             ForEachWindow(calibration, [&](const EstimatorRun& run, const WindowEstimate& w) {
               if (w.arc) WriteArcRow(out, log, run, w);
             });
           });
}

void WriteWindows(const Calibration& calibration, const std::string& log,
                  const std::filesystem::path& path) {
  WriteCsv(path, kWindowsHeader, [&](std::ostream& out) {
    ForEachWindow(calibration, [&](const EstimatorRun& run, const WindowEstimate& w) {
      const std::string window = fmt::format("{},{},{},{},{},{}", log, run.estimator, run.gamma,
                                             w.tau, TimeText(w.begin), TimeText(w.end));
      for (const ParameterEstimate& p : w.parameters) WriteParameterRow(out, window, p);
    });
  });
}

void WriteResiduals(const Calibration& calibration, const std::string& log,
                    const std::filesystem::path& path) {
  WriteCsv(path,
           "log,estimator,gamma,tau,t [s],gate [1],r_x [m],r_y [m],r_z [m],sigma [m],weight [1]",
           [&](std::ostream& out) {
             ForEachWindow(calibration, [&](const EstimatorRun& run, const WindowEstimate& w) {
               for (const FixMisfit& m : w.misfits) {
                 fmt::print(out, "{},{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", log,
                            run.estimator, run.gamma, w.tau, TimeText(m.t), m.gate, m.error.x(),
                            m.error.y(), m.error.z(), m.sigma, m.weight);
               }
             });
           });
}

// Only the reported run: the files of all gammas would be hard to read.
void WriteTrajectory(const Calibration& calibration, const std::filesystem::path& path) {
  const EstimatorRun& run = calibration.Reported();
  WriteCsv(path, "t [s],estimator,kind,tau,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]",
           [&](std::ostream& out) {
             const auto write = [&](const char* kind, int tau,
                                    const std::vector<TrajectoryPoint>& points) {
               for (const TrajectoryPoint& x : points) {
                 fmt::print(out, "{},{},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f}\n",
                            TimeText(x.t), run.estimator, kind, tau, x.p_E.x(), x.p_E.y(),
                            x.p_E.z(), x.v_E.x(), x.v_E.y(), x.v_E.z());
               }
             };
             for (const WindowEstimate& w : run.windows) {
               write("fit", w.tau, w.fitted);
               write("prediction", w.tau, w.predicted);
             }
             if (calibration.whole_flight) {
               write("smoothed", 0, calibration.whole_flight->trajectory);
             }
           });
}

YAML::Node ArcsNode(const EstimatorRun& run) {
  const ArcSummary arcs = SummariseArcs(run);
  YAML::Node node;
  node["count"] = arcs.error.count;
  if (arcs.error.count == 0) return node;
  node["final_point_error"] = FlowMap({{"mean", Rounded(arcs.error.mean, 4)},
                                       {"median", Rounded(arcs.error.median, 4)},
                                       {"p95", Rounded(arcs.error.p95, 4)},
                                       {"unit", "m"}});
  node["inside_95_ellipse"] = Rounded(arcs.Coverage(), 3);
  return node;
}

// How a flight without gates was divided, and the prior of its fixes' noise.
YAML::Node ContinuousFixesNode(const ContinuousFixes& fixes, const WindowEstimate& last) {
  YAML::Node node;
  node["text"] = fixes.Text();
  node["rate_hz"] = Rounded(fixes.rate, 4);
  node["arc_s"] = Rounded(fixes.arc, 4);
  node["pass_s"] = Rounded(fixes.pass, 4);
  node["white_sigma_m"] = Rounded(fixes.noise.white, 3);
  node["correlation_time_s"] = Rounded(fixes.noise.correlation_time, 4);
  if (last.fix_latency) node["parameters"] = ParameterNode({*last.fix_latency});
  return node;
}

YAML::Node WholeFlightNode(const WholeFlight& whole) {
  YAML::Node node;
  node["flights"] = whole.flights;
  node["passes"] = whole.passes;
  node["duration"] = Rounded(whole.seconds, 6);  // s
  node["converged"] = whole.converged;
  node["iterations"] = whole.iterations;
  node["parameters"] = ParameterNode(whole.parameters);
  node["unobservable"] = whole.unobservable;
  node["notes"] = whole.notes;
  for (const LearnedStrength& strength : whole.strengths) {
    YAML::Node entry;
    entry["value"] = Rounded(strength.value, 4);
    entry["interval95"].push_back(Rounded(strength.lower, 4));
    entry["interval95"].push_back(Rounded(strength.upper, 4));
    entry["unit"] = strength.unit;
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node["strengths"][strength.name] = entry;
  }
  return node;
}

// Estimates of the last window; empty if the flight has no window.
WindowEstimate LastWindow(const Calibration& calibration) {
  const EstimatorRun& run = calibration.Reported();
  return run.windows.empty() ? WindowEstimate() : run.windows.back();
}

YAML::Node CalibrationNode(const Calibration& calibration, const YAML::Node& provenance) {
  const EstimatorRun& run = calibration.Reported();
  const WindowEstimate last = LastWindow(calibration);
  YAML::Node node = VerdictNode(calibration.verdict, calibration.warnings);
  node["estimator"] = run.estimator;
  node["gamma"] = run.gamma;
  node["parameters"] = ParameterNode(last.parameters);
  node["unobservable"] = last.unobservable;
  if (calibration.whole_flight) {
    node["whole_flight"] = WholeFlightNode(*calibration.whole_flight);
  }
  if (calibration.continuous) node["fixes"] = ContinuousFixesNode(*calibration.continuous, last);
  node["arcs"] = ArcsNode(run);
  node["provenance"] = provenance;
  return node;
}

std::string ParameterTable(const std::vector<ParameterEstimate>& parameters) {
  std::string table;
  for (const ParameterEstimate& p : parameters) {
    const bool angle = p.unit == "rad";
    table += fmt::format(
        "  {:<12}{:>10.4f} +- {:<8.4f} {:<6}{:>22}  {:<13} {}\n", p.name, p.value, p.sigma, p.unit,
        angle ? fmt::format("({:.2f} +- {:.2f} deg)", p.value / kDegree, p.sigma / kDegree) : "",
        p.status, p.name == "fix_latency" ? "delay of the fixes" : MeaningOf(p.name));
  }
  return table;
}

std::string WholeFlightTable(const WholeFlight& whole) {
  std::string table = fmt::format(
      "\nparameters from {} at once ({} passes, {:.0f} s{})\n",
      whole.flights == 1 ? "the whole flight" : fmt::format("{} whole flights", whole.flights),
      whole.passes, whole.seconds, whole.converged ? "" : "; not converged");
  table += ParameterTable(whole.parameters);
  for (const LearnedStrength& s : whole.strengths) {
    table += fmt::format("  {:<16}{:>10.4f} ({:.4f} to {:.4f}){}\n", s.name, s.value, s.lower,
                         s.upper, AfterNumber(s.unit));
  }
  return table;
}

}  // namespace

void WriteCalibration(const Calibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory) {
  const std::string name = CsvField(log.name.empty() ? log.directory : log.name);
  WriteArcs(calibration, name, directory / "arcs.csv");
  WriteWindows(calibration, name, directory / "windows.csv");
  WriteResiduals(calibration, name, directory / "residuals.csv");
  WriteTrajectory(calibration, directory / "trajectory.csv");
  const std::vector<ParameterEstimate> model = calibration.whole_flight
                                                   ? calibration.whole_flight->parameters
                                                   : LastWindow(calibration).parameters;
  WriteFileAtomically(directory / "model.yaml",
                      TextOf(ModelNode(model, calibration.effects, provenance)));
  WriteFileAtomically(directory / "calibration.yaml",
                      TextOf(CalibrationNode(calibration, provenance)));
}

YAML::Node Provenance(const FlightLog& log, std::uint64_t seed, const YAML::Node& config,
                      std::span<const FlightLog> further) {
  YAML::Node node;
  node["version"] = Version();
  node["log"] = log.directory;
  for (const auto& [file, digest] : log.sha256) node["sha256"][file] = digest;
  for (const FlightLog& other : further) {
    YAML::Node entry;
    entry["log"] = other.directory;
    for (const auto& [file, digest] : other.sha256) entry["sha256"][file] = digest;
    node["further"].push_back(entry);
  }
  node["seed"] = seed;
  node["config"] = config;
  return node;
}

std::string CalibrationTable(const Calibration& calibration) {
  const EstimatorRun& reported = calibration.Reported();
  const WindowEstimate last = LastWindow(calibration);
  std::string table = calibration.continuous ? calibration.continuous->Text() + "\n\n" : "";
  table += "error at the end of arcs, each predicted from the gamma passes before it\n";
  table += fmt::format("{:<14}{:>6}{:>7}{:>10}{:>10}{:>10}{:>12}{:>12}\n", "estimator", "gamma",
                       "arcs", "mean [m]", "median", "p95", "in 95 %", "iterations");
  for (const EstimatorRun& run : calibration.runs) {
    // The sweep over gamma of further estimators stands in the files and on the page.
    if (run.estimator != reported.estimator && run.gamma != reported.gamma) continue;
    const ArcSummary arcs = SummariseArcs(run);
    std::vector<double> iterations;
    for (const WindowEstimate& w : run.windows) iterations.push_back(w.iterations);
    if (arcs.error.count == 0) {
      table += fmt::format("{:<14}{:>6}{:>7}   (no arc with truth)\n", run.estimator, run.gamma, 0);
      continue;
    }
    table +=
        fmt::format("{:<14}{:>6}{:>7}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.0f} %{:>12.1f}\n",
                    run.estimator, run.gamma, arcs.error.count, arcs.error.mean, arcs.error.median,
                    arcs.error.p95, 100.0 * arcs.Coverage(), Mean(iterations));
  }
  table += fmt::format("\nparameters from the last window ({}, gamma {})\n", reported.estimator,
                       reported.gamma);
  table += ParameterTable(last.parameters);
  if (last.fix_latency) table += ParameterTable({*last.fix_latency});
  table += UnobservableText(last.unobservable);
  if (calibration.whole_flight) table += WholeFlightTable(*calibration.whole_flight);
  return table + VerdictText(calibration.verdict);
}

}  // namespace trueline
