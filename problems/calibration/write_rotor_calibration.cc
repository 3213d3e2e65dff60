#include "problems/calibration/write_rotor_calibration.h"

#include <fmt/format.h>

#include <cmath>

#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node ParameterNode(const RotorCalibration& c) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ParameterEstimate& p : c.parameters) {
    YAML::Node entry;
    entry["value"] = Rounded(p.value, 6);
    entry["sigma"] = Rounded(p.sigma, 3);
    entry["unit"] = p.unit;
    entry["status"] = p.status;
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node[p.name] = entry;
  }
  return node;
}

YAML::Node PredictionNode(const RotorCalibration& c) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const HorizonScore& score : c.predictions) {
    if (score.count == 0) continue;
    YAML::Node entry;
    entry["horizon"] = score.horizon;
    entry["count"] = score.count;
    entry["before"] = Rounded(score.before, 4);
    entry["after"] = Rounded(score.after, 4);
    entry["after_rms"] = Rounded(score.after_rms, 4);
    entry["unit"] = "m";
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node.push_back(entry);
  }
  return node;
}

YAML::Node CalibrationNode(const RotorCalibration& c, const YAML::Node& provenance) {
  YAML::Node node;
  node["verdict"] = c.verdict.word;
  node["reasons"] = c.verdict.reasons;
  node["warnings"] = c.warnings;
  node["drive"] = "rotors";
  node["estimator"] = "batch";
  node["parameters"] = ParameterNode(c);
  node["unobservable"] = c.unobservable;
  node["open_loop"] = PredictionNode(c);
  node["noise"] = ToYaml(c.noise);
  node["rotor_delay"] = c.rotor_delay;
  node["fit"]["chi_square"] = Rounded(c.chi_square, 4);
  node["fit"]["iterations"] = c.batch.iterations;
  node["fit"]["solve_time"] = Rounded(c.batch.solve_time, 3);
  node["fit"]["halves_differ"] = Rounded(c.halves, 3);
  node["fit"]["halves_parameter"] = c.halves_parameter;
  node["provenance"] = provenance;
  return node;
}

double Seconds(const RotorCalibration& c, double t) { return ToSeconds(c.origin) + t; }

std::string TrajectoryCsv(const RotorCalibration& c) {
  std::string text =
      "t [s],estimator,kind,tau,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],qw [1],qx [1],qy "
      "[1],qz [1],wx [rad/s],wy [rad/s],wz [rad/s]\n";
  for (std::size_t i = 0; i < c.batch.nodes.size(); ++i) {
    const RotorNode& n = c.batch.nodes[i];
    text += fmt::format("{:.6f},batch,fit,1", Seconds(c, c.pose_times[i]));
    for (int j = 4; j < 10; ++j) text += fmt::format(",{:.6f}", n[j]);
    for (int j = 0; j < 4; ++j) text += fmt::format(",{:.8f}", n[j]);
    for (int j = 10; j < 13; ++j) text += fmt::format(",{:.6f}", n[j]);
    text += "\n";
  }
  return text;
}

std::string WindowsCsv(const RotorCalibration& c, const std::string& log) {
  std::string text =
      "log,estimator,gamma,tau,t_start [s],t_end [s],parameter,value,sigma,unit,status\n";
  const double start = c.filter.history.front().t;
  double next = start + 0.5;
  int tau = 0;
  const auto row = [&](const char* estimator, int window, double t, const ParameterEstimate& p,
                       double value, double sigma) {
    text += fmt::format("{},{},0,{},{:.6f},{:.6f},{},{:.8g},{:.6g},{},{}\n", log, estimator, window,
                        Seconds(c, start), Seconds(c, t), p.name, value, sigma, p.unit, p.status);
  };
  for (const RotorEstimate& e : c.filter.history) {
    if (e.t < next) continue;
    next = e.t + 0.5;
    ++tau;
    for (const ParameterEstimate& p : c.parameters) {
      const int i = FindRotorConstant(p.name);
      row("filter", tau, e.t, p, e.mean[i], e.sigma[i]);
    }
  }
  for (const ParameterEstimate& p : c.parameters) {
    row("batch", tau, c.filter.history.back().t, p, p.value, p.sigma);
  }
  return text;
}

std::string PredictionsCsv(const RotorCalibration& c) {
  std::string text = "t [s],horizon [s],error [m]\n";
  for (const OpenLoopError& e : c.open_loop) {
    text += fmt::format("{:.6f},{},{:.6g}\n", e.t, e.horizon, e.error);
  }
  return text;
}

}  // namespace

void WriteRotorCalibration(const RotorCalibration& calibration, const FlightLog& log,
                           const YAML::Node& provenance, const std::filesystem::path& directory) {
  std::string name = log.name.empty() ? "flight" : log.name;
  if (name.find_first_of(",\"\r\n") != std::string::npos) name = "flight";
  WriteFileAtomically(directory / "trajectory.csv", TrajectoryCsv(calibration));
  WriteFileAtomically(directory / "windows.csv", WindowsCsv(calibration, name));
  WriteFileAtomically(directory / "predictions.csv", PredictionsCsv(calibration));
  YAML::Node model;
  model["parameters"] = ParameterNode(calibration);
  model["effects"] = YAML::Node(YAML::NodeType::Sequence);
  model["effects"].SetStyle(YAML::EmitterStyle::Flow);
  model["provenance"] = provenance;
  WriteFileAtomically(directory / "model.yaml", TextOf(model));
  WriteFileAtomically(directory / "calibration.yaml",
                      TextOf(CalibrationNode(calibration, provenance)));
}

std::string RotorCalibrationTable(const RotorCalibration& c) {
  std::string table = fmt::format("{:<12}{:>13}{:>12}  {:<9}{:>13}  {}\n", "parameter", "batch",
                                  "sigma", "unit", "filter", "status");
  for (const ParameterEstimate& p : c.parameters) {
    table += fmt::format("{:<12}{:>13.5g}{:>12.2g}  {:<9}{:>13.5g}  {}\n", p.name, p.value, p.sigma,
                         p.unit, c.filter.history.back().mean[FindRotorConstant(p.name)], p.status);
  }
  for (const std::string& combination : c.unobservable) {
    table += fmt::format("  not shown by this flight: {}\n", combination);
  }
  for (const HorizonScore& s : c.predictions) {
    if (s.count == 0) continue;
    table += fmt::format(
        "open loop over {:.2f} s on held-out flight: {:.3f} m (nominal vehicle {:.3f} m), {} "
        "starts\n",
        s.horizon, s.after, s.before, s.count);
  }
  table += fmt::format("\nverdict: {}\n", c.verdict.word);
  for (const std::string& reason : c.verdict.reasons) table += "  " + reason + "\n";
  return table;
}

}  // namespace trueline
