#include <fmt/ostream.h>

#include <algorithm>
#include <numeric>

#include "problems/common/atomic_file.h"
#include "problems/common/parallel.h"
#include "problems/prediction/multi_step_experiment.h"
#include "problems/prediction/tube.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

constexpr int kScoreDigits = 5, kShareDigits = 3;
constexpr std::array<int, 3> kShownHorizons = {1, 10, 50};

YAML::Node ErrorsNode(const MultiStepErrors& errors) {
  YAML::Node node;
  for (int a = 0; a < 4; ++a) {
    YAML::Node quantity;
    for (const int h : kShownHorizons) {
      quantity[fmt::format("h{}", h)] = Rounded(errors.mean[a][h - 1], kScoreDigits);
    }
    quantity["sum"] = Rounded(errors.Sum(a), kScoreDigits);
    quantity["unit"] = kScoredUnits[a];
    quantity.SetStyle(YAML::EmitterStyle::Flow);
    node[kScoredQuantities[a]] = quantity;
  }
  return node;
}

double MeanOf(const std::array<double, PredictionWindow::kSteps>& steps) {
  return std::accumulate(steps.begin(), steps.end(), 0.0) / static_cast<double>(steps.size());
}

// Shares of windows that the tubes hold, by "50 %", ..., "95 % learned".
std::vector<std::pair<std::string, QuantitySteps>> NamedShares(const TubeRow& row) {
  std::vector<std::pair<std::string, QuantitySteps>> named;
  for (const auto& [by, held] :
       {std::pair{"", &row.held.followed}, {" learned", &row.held.learned}}) {
    for (std::size_t c = 0; c < kTubeChances.size(); ++c) {
      named.emplace_back(fmt::format("{:g} %{}", 100.0 * kTubeChances[c], by), (*held)[c]);
    }
  }
  return named;
}

// The shares at the shown horizons, and the mean over all.
YAML::Node TubeNode(const TubeRow& row) {
  YAML::Node node;
  node["trajectory"] = row.trajectory;
  for (const auto& [name, shares] : NamedShares(row)) {
    for (int a = 0; a < 4; ++a) {
      YAML::Node held;
      for (const int h : kShownHorizons) {
        held[fmt::format("h{}", h)] = Rounded(shares[a][h - 1], kShareDigits);
      }
      held["mean"] = Rounded(MeanOf(shares[a]), kShareDigits);
      held.SetStyle(YAML::EmitterStyle::Flow);
      node[name][kScoredQuantities[a]] = held;
    }
  }
  return node;
}

YAML::Node FitNode(const PredictionSetup& setup, const PredictionFit& fit,
                   const std::vector<std::string>& trained_on) {
  YAML::Node node;
  node["trained_on"] = trained_on;
  node["windows"] = fit.windows;
  node["converged"] = fit.converged;
  node["cost"] = Rounded(fit.cost, kScoreDigits);
  node["numbers"] = NumbersNode(setup.numbers, fit.numbers, fit.sigmas, kScoreDigits);
  for (std::size_t i = 0; i < kProcessNames.size(); ++i) {
    node["processes"][kProcessNames[i]] = ToYaml(fit.processes[i]);
  }
  return node;
}

void PrintHorizons(const MultiStepResult& result, std::ostream& out) {
  for (const MultiStepRow& row : result.rows) {
    for (const auto& [average, errors] : {std::pair{"concatenated", &row.score.concatenated},
                                          std::pair{"within", &row.score.within}}) {
      for (int k = 0; k < PredictionWindow::kSteps; ++k) {
        fmt::print(out, "\"{}\",\"{}\",{},{},{:.6g},{:.6g},{:.6g},{:.6g}\n", row.trajectory,
                   row.predictor, average, k + 1, errors->mean[0][k], errors->mean[1][k],
                   errors->mean[2][k], errors->mean[3][k]);
      }
    }
  }
}

}  // namespace

void WriteMultiStep(const MultiStepExperiment& experiment, const MultiStepResult& result,
                    const std::filesystem::path& directory) {
  YAML::Node node = HeadNode(experiment);
  for (const MultiStepRow& row : result.rows) {
    YAML::Node score;
    score["trajectory"] = row.trajectory;
    score["predictor"] = row.predictor;
    score["concatenated"] = ErrorsNode(row.score.concatenated);
    score["within"] = ErrorsNode(row.score.within);
    node["scores"].push_back(score);
  }
  for (const TubeRow& row : result.tubes) node["tubes"].push_back(TubeNode(row));
  for (const PublishedScore& published : experiment.published) {
    YAML::Node entry;
    entry["name"] = published.name;
    entry["average"] = published.average;
    entry["sums"] = published.sums;
    entry["sums"].SetStyle(YAML::EmitterStyle::Flow);
    for (const auto& [horizon, values] : published.at) {
      entry[horizon] = values;
      entry[horizon].SetStyle(YAML::EmitterStyle::Flow);
    }
    node["published"].push_back(entry);
  }
  node["fit"] = FitNode(experiment.setup, result.fit, result.trained_on);
  for (const MultiStepFold& fold : result.folds) {
    node["folds"][fold.trajectory] = FitNode(experiment.setup, fold.fit, fold.trained_on);
  }
  WriteCsv(directory / "horizons.csv",
           "trajectory,predictor,average,horizon [1],p [m],v [m/s],R [rad],w [rad/s]",
           [&](std::ostream& out) { PrintHorizons(result, out); });
  WriteFileAtomically(
      directory / "model.yaml",
      TextOf(FittedModelNode(experiment.setup.vehicle, experiment.setup.numbers, result.fit.numbers,
                             result.fit.sigmas, node["provenance"])));
  WriteFileAtomically(directory / "summary.yaml", TextOf(node));
}

std::string MultiStepBrief(const MultiStepResult& result) {
  std::string table =
      fmt::format("{:<12}{:<26}{:>10}{:>10}{:>10}{:>10}   {:>9}{:>9}{:>9}{:>9}\n", "sums over h",
                  "", "p [m]", "v [m/s]", "R [rad]", "w [rad/s]", "p", "v", "R", "w within");
  for (const MultiStepRow& row : result.rows) {
    table += fmt::format("{:<12}{:<26}", row.trajectory, row.predictor);
    for (int a = 0; a < 4; ++a) table += fmt::format("{:>10.3f}", row.score.concatenated.Sum(a));
    table += "   ";
    for (int a = 0; a < 4; ++a) table += fmt::format("{:>9.3f}", row.score.within.Sum(a));
    table += "\n";
  }
  table += "\nshare of windows that the tubes hold, mean over h\n";
  for (const TubeRow& row : result.tubes) {
    for (const auto& [name, shares] : NamedShares(row)) {
      table += fmt::format("{:<12}{:<26}", row.trajectory, name);
      for (const auto& of : shares) table += fmt::format("{:>8.0f} %", 100.0 * MeanOf(of));
      table += "\n";
    }
  }
  return table;
}

std::string MultiStepTable(const MultiStepExperiment& experiment, const MultiStepResult& result) {
  return MultiStepBrief(result) + "\nnumbers (fitted to all training runs)\n" +
         NumbersTable(experiment.setup.numbers, result.fit.numbers, result.fit.sigmas);
}

namespace {

constexpr char kHeader[] =
    "run,start row [1],step [1],px [m],py [m],pz [m],vx [m/s],vy [m/s],vz [m/s],"
    "qw [1],qx [1],qy [1],qz [1],wx [rad/s],wy [rad/s],wz [rad/s]";

// The tube's columns: "p 50 % [m]" and so on.
std::string Header() {
  std::string header = kHeader;
  for (const double chance : kTubeChances) {
    for (int a = 0; a < 4; ++a) {
      header +=
          fmt::format(",{} {:g} % [{}]", kScoredQuantities[a], 100.0 * chance, kScoredUnits[a]);
    }
  }
  return header;
}

void Print(const std::string& run, int row, const SpreadStates& predicted, const Tube& factors,
           fmt::memory_buffer* out) {
  const auto text = fmt::appender(*out);
  for (int k = 0; k < PredictionWindow::kSteps; ++k) {
    fmt::format_to(text, "{},{},{}", run, row, k + 1);
    for (const double value : predicted.states.col(k)) fmt::format_to(text, ",{:.6g}", value);
    for (const QuantitySteps& of_chance : factors) {
      for (int a = 0; a < 4; ++a) {
        fmt::format_to(text, ",{:.4g}", of_chance[a][k] * predicted.spread[a][k]);
      }
    }
    out->push_back('\n');
  }
}

// What the fit predicts from every `stride`-th row of a run. Windows are computed on all threads, a
// block at a time.
void PrintRun(const PredictionFit& fit, const PredictionSetup& setup, const PredictionRun& run,
              int stride, int threads, std::ostream& out) {
  constexpr int kBlock = 512, kPiece = 32;  // windows
  const PredictionModel model(setup.vehicle, fit.processes, fit.numbers);
  const std::string name = CsvField(run.name);
  const int windows = (run.num_windows() + stride - 1) / stride;
  FollowedFactors followed(fit.tube);
  for (int first = 0; first < windows; first += kBlock) {
    const int count = std::min(kBlock, windows - first);
    std::vector<SpreadStates> predicted(count);
    std::vector<Tube> factors(count);
    std::vector<fmt::memory_buffer> texts(count);
    const auto predict = [&](int i) {
      predicted[i] = PredictSpread(model, fit.numbers, run, (first + i) * stride);
    };
    ParallelRuns(count, kPiece, predict, threads);
    for (int i = 0; i < count; ++i) {
      factors[i] = followed.Next((first + i) * stride, predicted[i].ratios);
    }
    const auto print = [&](int i) {
      Print(name, (first + i) * stride, predicted[i], factors[i], &texts[i]);
    };
    ParallelRuns(count, kPiece, print, threads);
    for (const fmt::memory_buffer& text : texts) {
      out.write(text.data(), static_cast<std::streamsize>(text.size()));
    }
  }
}

}  // namespace

void WritePredictions(const MultiStepExperiment& experiment, const MultiStepResult& result,
                      int threads, const std::filesystem::path& directory) {
  WriteCsv(directory / "predictions.csv", Header(), [&](std::ostream& out) {
    for (const PredictionRun& run : result.predicted) {
      PrintRun(result.FitFor(run.trajectory), experiment.setup, run, experiment.predictions_stride,
               threads, out);
    }
  });
}

}  // namespace trueline
