#include "problems/experiment/write_rotor_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

constexpr int kDigits = 4;

YAML::Node EstimatorNode(const EstimatorScore& score) {
  YAML::Node node;
  node["rmse"] = Rounded(score.rmse, kDigits);
  node["mean_error"] = Rounded(score.mean_error, kDigits);
  node["sigma"] = Rounded(score.sigma, kDigits);
  node["coverage95"] = Rounded(score.coverage, kDigits);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node ScoresNode(const std::vector<ConstantScore>& scores) {
  YAML::Node node(YAML::NodeType::Map);
  for (const ConstantScore& score : scores) {
    YAML::Node entry;
    entry["unit"] = score.unit;
    entry["first_guess"] = Rounded(score.first_guess, kDigits);
    entry["bound"] = Rounded(score.bound, kDigits);
    entry["filter"] = EstimatorNode(score.filter);
    entry["batch"] = EstimatorNode(score.batch);
    node[score.name] = entry;
  }
  return node;
}

YAML::Node SummaryNode(const RotorExperiment& experiment,
                       const std::vector<KindSummary>& summaries) {
  YAML::Node node;
  node["name"] = experiment.name;
  node["about"] = experiment.about;
  for (const KindSummary& s : summaries) {
    YAML::Node kind;
    kind["name"] = s.name;
    kind["flights"] = s.flights;
    kind["failures"] = s.failures;
    kind["path_error_rms"] = Rounded(s.path_error, kDigits);
    kind["nees"]["filter"] = Rounded(s.filter_nees, kDigits);
    kind["nees"]["batch"] = Rounded(s.batch_nees, kDigits);
    kind["nees_median"]["filter"] = Rounded(s.filter_nees_median, kDigits);
    kind["nees_median"]["batch"] = Rounded(s.batch_nees_median, kDigits);
    kind["rmse_over_bound"]["filter"] = Rounded(s.filter_over_bound, kDigits);
    kind["rmse_over_bound"]["batch"] = Rounded(s.batch_over_bound, kDigits);
    kind["constants"] = ScoresNode(s.constants);
    kind["groups"] = ScoresNode(s.groups);
    node["kinds"].push_back(kind);
  }
  node["provenance"]["version"] = Version();
  node["provenance"]["source"] = experiment.file;
  node["provenance"]["seed"] = experiment.seed;
  node["provenance"]["config"] = experiment.config;
  return node;
}

std::string TrialsCsv(const RotorExperiment& experiment, const std::vector<RotorTrial>& trials) {
  std::string text =
      "kind,seed,parameter,unit,first_guess,filter_error,filter_sigma,batch_error,batch_sigma,"
      "bound\n";
  for (const RotorTrial& t : trials) {
    if (!t.failure.empty()) continue;
    for (const int i : experiment.prior.Free()) {
      const RotorConstantInfo& info = RotorConstantNames()[i];
      text += fmt::format("{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
                          experiment.kinds[t.kind].name, t.seed, info.name, info.unit,
                          t.first_guess[i], t.filter_error[i], t.filter_sigma[i], t.batch_error[i],
                          t.batch_sigma[i], t.bound[i]);
    }
  }
  return text;
}

// Estimates of all flights of one kind at one time.
struct Moment {
  double t = 0.0;
  int count = 0;
  RotorConstants error = RotorConstants::Zero(), square = error, variance = error;
};

std::vector<Moment> MomentsOf(const std::vector<RotorTrial>& trials, int kind) {
  std::vector<Moment> moments;
  for (const RotorTrial& trial : trials) {
    if (trial.kind != kind || !trial.failure.empty()) continue;
    constexpr int kEvery = 6;  // every sixth pose: about 0.2 s
    for (std::size_t j = 0; j * kEvery < trial.history.size(); ++j) {
      const RotorEstimate& estimate = trial.history[j * kEvery];
      if (moments.size() <= j) moments.resize(j + 1);
      moments[j].t = estimate.t;
      ++moments[j].count;
      moments[j].error += estimate.mean;
      moments[j].square += estimate.mean.cwiseAbs2();
      moments[j].variance += estimate.sigma.cwiseAbs2();
    }
  }
  return moments;
}

std::string HistoryCsv(const RotorExperiment& experiment, const std::vector<RotorTrial>& trials) {
  std::string text = "kind,t [s],parameter,unit,truth,mean_error,spread,rmse,sigma\n";
  const RotorSimulation& sim = experiment.simulation;
  for (std::size_t k = 0; k < experiment.kinds.size(); ++k) {
    for (const Moment& m : MomentsOf(trials, static_cast<int>(k))) {
      for (const int i : experiment.prior.Free()) {
        const double mean = m.error[i] / m.count, square = m.square[i] / m.count;
        const double truth = i + RotorAeroModel::kMoving < RotorDrivenModel::kStates
                                 ? sim.vehicle.parameters[i + RotorAeroModel::kMoving]
                                 : 0.0;
        text += fmt::format("{},{:.3f},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n",
                            experiment.kinds[k].name, m.t, RotorConstantNames()[i].name,
                            RotorConstantNames()[i].unit, truth, mean,
                            std::sqrt(std::max(0.0, square - mean * mean)), std::sqrt(square),
                            std::sqrt(m.variance[i] / m.count));
      }
    }
  }
  return text;
}

}  // namespace

void WriteRotorExperiment(const RotorExperiment& experiment, const RotorExperimentRun& run,
                          const std::filesystem::path& directory) {
  const std::vector<RotorTrial>& trials = run.trials;
  for (std::size_t k = 0; k < run.paths.size(); ++k) {
    if (!run.paths[k] || experiment.kinds[k].kind == "file") continue;
    std::string name = experiment.kinds[k].name;
    std::replace_if(
        name.begin(), name.end(), [](char c) { return c == ' ' || c == '/'; }, '_');
    WriteFileAtomically(directory / ("trajectory_" + name + ".yaml"),
                        TrajectoryYaml(*run.paths[k]));
  }
  WriteFileAtomically(directory / "trials.csv", TrialsCsv(experiment, trials));
  WriteFileAtomically(directory / "history.csv", HistoryCsv(experiment, trials));
  WriteFileAtomically(directory / "summary.yaml",
                      TextOf(SummaryNode(experiment, SummariseRotorTrials(experiment, trials))));
}

std::string RotorExperimentTable(const std::vector<KindSummary>& summaries) {
  std::string table;
  for (const KindSummary& s : summaries) {
    table += fmt::format("{}: {} flights{}\n", s.name, s.flights,
                         s.failures > 0 ? fmt::format(", {} without result", s.failures) : "");
    if (s.flights == 0) continue;
    table += fmt::format("  {:<10}{:>11}{:>11}{:>7}{:>11}{:>11}{:>7}{:>11}\n", "", "filter rmse",
                         "sigma", "in 95", "batch rmse", "sigma", "in 95", "bound");
    const auto row = [&](const ConstantScore& c) {
      table += fmt::format(
          "  {:<10}{:>11.3g}{:>11.3g}{:>5.0f} %{:>11.3g}{:>11.3g}{:>5.0f} %"
          "{:>11.3g} {}\n",
          c.name, c.filter.rmse, c.filter.sigma, 100.0 * c.filter.coverage, c.batch.rmse,
          c.batch.sigma, 100.0 * c.batch.coverage, c.bound, c.unit);
    };
    for (const ConstantScore& c : s.constants) row(c);
    for (const ConstantScore& c : s.groups) row(c);
    table += fmt::format(
        "  RMSE over bound: filter {:.3f}, batch {:.3f}; NEES (median): {:.2f} ({:.2f}), {:.2f} "
        "({:.2f})\n\n",
        s.filter_over_bound, s.batch_over_bound, s.filter_nees, s.filter_nees_median, s.batch_nees,
        s.batch_nees_median);
  }
  return table;
}

}  // namespace trueline
