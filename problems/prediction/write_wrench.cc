#include <fmt/format.h>

#include "problems/common/atomic_file.h"
#include "problems/prediction/wrench_experiment.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

constexpr int kWrenchDigits = 4;

YAML::Node WrenchScoreNode(const WrenchScore& score) {
  YAML::Node node;
  node["flight"] = score.flight;
  node["predictor"] = score.predictor;
  node["truth"] = score.reading;
  if (score.fitted_to > 0) node["fitted_to"] = score.fitted_to;
  constexpr const char* kForces[] = {"fx", "fy", "fz"};
  constexpr const char* kMoments[] = {"tx", "ty", "tz"};
  for (int i = 0; i < 3; ++i) {
    node["force"][kForces[i]] = Rounded(score.errors.force[i], kWrenchDigits);
    node["moment"][kMoments[i]] = Rounded(score.errors.moment[i], kWrenchDigits);
  }
  node["force"]["F"] = Rounded(score.errors.F(), kWrenchDigits);
  node["force"]["unit"] = "N";
  node["moment"]["M"] = Rounded(score.errors.M(), kWrenchDigits);
  node["moment"]["unit"] = "N m";
  node["force"].SetStyle(YAML::EmitterStyle::Flow);
  node["moment"].SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

YAML::Node FoldNode(const WrenchExperiment& experiment, const WrenchFold& fold) {
  YAML::Node node;
  node["test"] = fold.test;
  node["train"] = fold.train;
  node["rows"] = fold.fit.rows;
  node["numbers"] =
      NumbersNode(experiment.numbers, fold.fit.numbers, fold.fit.sigmas, kWrenchDigits);
  constexpr const char* kAxes[] = {"roll", "pitch", "yaw"};
  for (int axis = 0; axis < 3; ++axis) {
    node["share_of_moment"][kAxes[axis]] = Rounded(fold.fit.share[axis], kWrenchDigits);
  }
  node["moment_washout"]["washout"] = Rounded(fold.fit.washout.washout, kWrenchDigits);
  node["moment_washout"]["lag"] = Rounded(fold.fit.washout.lag, kWrenchDigits);
  node["moment_washout"]["unit"] = "s";
  return node;
}

}  // namespace

void WriteWrench(const WrenchExperiment& experiment, const WrenchResult& result,
                 const std::filesystem::path& directory) {
  YAML::Node node = HeadNode(experiment);
  for (const WrenchScore& score : result.scores) node["scores"].push_back(WrenchScoreNode(score));
  for (const WrenchFold& fold : result.folds) node["folds"].push_back(FoldNode(experiment, fold));
  for (int i = 0; i < 3; ++i) node["stated_inertia"].push_back(experiment.inertia()[i]);
  node["stated_inertia"].SetStyle(YAML::EmitterStyle::Flow);
  WriteFileAtomically(directory / "summary.yaml", TextOf(node));
}

std::string WrenchBrief(const WrenchResult& result) {
  std::string table = fmt::format(
      "{:<38}{:<20}{:>8} {:<23}{:>7}{:>7}{:>7}{:>7}{:>9}{:>8}{:>8}{:>8}\n", "flight", "predictor",
      "flights", "truth", "fx [N]", "fy", "fz", "F", "tx [N m]", "ty", "tz", "M");
  for (const WrenchScore& s : result.scores) {
    const Eigen::Vector3d &f = s.errors.force, &t = s.errors.moment;
    table += fmt::format(
        "{:<38}{:<20}{:>8} "
        "{:<23}{:>7.3f}{:>7.3f}{:>7.3f}{:>7.3f}{:>9.4f}{:>8.4f}{:>8.4f}{:>8.4f}\n",
        s.flight, s.predictor, s.fitted_to > 0 ? std::to_string(s.fitted_to) : "", s.reading, f[0],
        f[1], f[2], s.errors.F(), t[0], t[1], t[2], s.errors.M());
  }
  return table;
}

std::string WrenchTable(const WrenchExperiment& experiment, const WrenchResult& result) {
  std::string table = WrenchBrief(result);
  for (const WrenchFold& fold : result.folds) {
    table +=
        fmt::format("\nnumbers for {}, fitted to {}\n", fold.test, fmt::join(fold.train, ", "));
    table += NumbersTable(experiment.numbers, fold.fit.numbers, fold.fit.sigmas);
    table += fmt::format(
        "  share of the net moment that turns the vehicle: {:.2f} in roll and {:.2f} in pitch, of "
        "moments faster than {:.3f} s and {:.3f} s late; {:.2f} in yaw\n",
        fold.fit.share[0], fold.fit.share[1], fold.fit.washout.washout, fold.fit.washout.lag,
        fold.fit.share[2]);
  }
  return table;
}

}  // namespace trueline
