#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "problems/calibration/write_calibration.h"
#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

YAML::Node PredictionNode(const RotorCalibration& c) {
  YAML::Node node(YAML::NodeType::Sequence);
  for (const HorizonScore& score : c.predictions) {
    if (score.count == 0) continue;
    node.push_back(FlowMap({{"horizon", Rounded(score.horizon, 6)},
                            {"count", fmt::format("{}", score.count)},
                            {"before", Rounded(score.before, 4)},
                            {"after", Rounded(score.after, 4)},
                            {"after_rms", Rounded(score.after_rms, 4)},
                            {"inside_50", Rounded(score.inside[0], 3)},
                            {"inside_90", Rounded(score.inside[1], 3)},
                            {"inside_95", Rounded(score.inside[2], 3)},
                            {"region_50", Rounded(score.radius[0], 4)},
                            {"region_90", Rounded(score.radius[1], 4)},
                            {"region_95", Rounded(score.radius[2], 4)},
                            {"inside_95_by_noise", Rounded(score.inside_noise, 3)},
                            {"unit", "m"}}));
  }
  return node;
}

// By constant, where it is a tenth of the sigma or more.
YAML::Node SpeedNoiseBias(const RotorCalibration& c) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ParameterEstimate& p : c.parameters) {
    const double bias = c.speed_noise_bias[FindRotorConstant(p.name)];
    if (std::abs(bias) < 0.1 * p.sigma) continue;
    node[p.name] = FlowMap({{"value", Rounded(bias, 3)}, {"unit", p.unit}});
  }
  return node;
}

YAML::Node RotorCalibrationNode(const RotorCalibration& c, const YAML::Node& provenance) {
  YAML::Node node = VerdictNode(c.verdict, c.warnings);
  node["drive"] = "rotors";
  node["estimator"] = "batch";
  node["parameters"] = ParameterNode(c.parameters);
  node["unobservable"] = c.unobservable;
  node["open_loop"] = PredictionNode(c);
  node["noise"] = ToYaml(c.noise);
  node["rotor_delay"] = c.rotor_delay;
  node["gyro_delay"] = c.gyro_delay;
  node["rotor_speed_sigma"] = Rounded(c.speed_sigma, 3);
  node["rotor_speed_noise_bias"] = SpeedNoiseBias(c);
  node["fit"]["chi_square"] = Rounded(c.chi_square, 4);
  node["fit"]["iterations"] = c.batch.iterations;
  node["fit"]["solve_time"] = Rounded(c.batch.solve_time, 3);
  node["fit"]["halves_differ"] = Rounded(c.halves, 3);
  node["fit"]["halves_parameter"] = c.halves_parameter;
  node["fit"]["halves_disagree"] = c.halves_disagree;
  node["fit"]["biases_differ"] = c.biases_differ;
  node["provenance"] = provenance;
  return node;
}

double Seconds(const RotorCalibration& c, double t) { return ToSeconds(c.origin) + t; }

void WriteWindows(const RotorCalibration& c, const std::string& log,
                  const std::filesystem::path& path) {
  constexpr double kEvery = 0.5;  // s
  const std::vector<RotorEstimate>& history = c.filter.history;
  const auto window = [&](const char* estimator, int tau, double t) {
    return fmt::format("{},{},0,{},{:.6f},{:.6f}", log, estimator, tau,
                       Seconds(c, history.front().t), Seconds(c, t));
  };
  WriteCsv(path, kWindowsHeader, [&](std::ostream& out) {
    double next = history.front().t + kEvery;
    int tau = 0;
    for (const RotorEstimate& e : history) {
      if (e.t < next) continue;
      next = e.t + kEvery;
      const std::string fields = window("filter", ++tau, e.t);
      for (ParameterEstimate p : c.parameters) {
        const int i = FindRotorConstant(p.name);
        p.value = e.mean[i], p.sigma = e.sigma[i];
        WriteParameterRow(out, fields, p);
      }
    }
    const std::string fields = window("batch", tau, history.back().t);
    for (const ParameterEstimate& p : c.parameters) WriteParameterRow(out, fields, p);
  });
}

void WriteTrajectory(const RotorCalibration& c, const std::filesystem::path& path) {
  const auto header =
      "t [s],estimator,kind,tau,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],qw [1],qx [1],qy "
      "[1],qz [1],wx [rad/s],wy [rad/s],wz [rad/s]";
  WriteCsv(path, header, [&](std::ostream& out) {
    for (std::size_t i = 0; i < c.batch.nodes.size(); ++i) {
      const double* n = c.batch.nodes[i].motion.data();
      fmt::print(out, "{:.6f},batch,fit,1,{:.6f},{:.8f},{:.6f}\n", Seconds(c, c.pose_times[i]),
                 fmt::join(n + 4, n + 10, ","), fmt::join(n, n + 4, ","),
                 fmt::join(n + 10, n + 13, ","));
    }
  });
}

}  // namespace

void WriteCalibration(const RotorCalibration& calibration, const FlightLog& log,
                      const YAML::Node& provenance, const std::filesystem::path& directory) {
  const std::string name = CsvField(log.name.empty() ? "flight" : log.name);
  WriteTrajectory(calibration, directory / "trajectory.csv");
  WriteWindows(calibration, name, directory / "windows.csv");
  WriteCsv(directory / "predictions.csv", "t [s],horizon [s],error [m],rank [1]",
           [&](std::ostream& out) {
             for (const RotorForecast& e : calibration.open_loop) {
               fmt::print(out, "{:.6f},{},{:.6g},{:.6g}\n", Seconds(calibration, e.t), e.horizon,
                          e.error, e.rank);
             }
           });
  WriteFileAtomically(directory / "model.yaml",
                      TextOf(ModelNode(calibration.parameters, calibration.effects, provenance)));
  WriteFileAtomically(directory / "calibration.yaml",
                      TextOf(RotorCalibrationNode(calibration, provenance)));
}

std::string CalibrationTable(const RotorCalibration& c) {
  std::string table = fmt::format("{:<12}{:>13}{:>12}  {:<9}{:>13}  {}\n", "parameter", "batch",
                                  "sigma", "unit", "filter", "status");
  for (const ParameterEstimate& p : c.parameters) {
    table += fmt::format("{:<12}{:>13.5g}{:>12.2g}  {:<9}{:>13.5g}  {}\n", p.name, p.value, p.sigma,
                         p.unit, c.filter.history.back().mean[FindRotorConstant(p.name)], p.status);
  }
  table += UnobservableText(c.unobservable);
  for (const HorizonScore& s : c.predictions) {
    if (s.count == 0) continue;
    table += fmt::format(
        "open loop over {:.2f} s on held-out flight: {:.3f} m (nominal vehicle {:.3f} m), {} "
        "starts; 95 % region of the fitted part {:.3f} m, {:.0f} % inside ({:.0f} % by noise "
        "alone)\n",
        s.horizon, s.after, s.before, s.count, s.radius[2], 100.0 * s.inside[2],
        100.0 * s.inside_noise);
  }
  return table + VerdictText(c.verdict);
}

}  // namespace trueline
