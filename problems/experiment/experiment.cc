#include "problems/experiment/experiment.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/calibration/estimators.h"
#include "problems/common/error.h"
#include "problems/experiment/accuracy.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

YAML::Node ReadOptions(const YamlMap& map) {
  map.ChildOrEmpty("options");  // must be a mapping
  return map.RawNode("options");
}

std::vector<int> ReadGammas(const YamlMap& map, const std::vector<int>& fallback) {
  auto gammas = map.Get<std::vector<int>>("gammas", fallback);
  const bool valid = !gammas.empty() && *std::min_element(gammas.begin(), gammas.end()) >= 1;
  if (!valid) map.Fail("gammas", "needs window lengths of 1 or more passes, such as [1, 2, 3]");
  return gammas;
}

FlightSource ReadSimulation(const YamlMap& map) {
  FlightSource flight;
  flight.kind = FlightKind::kSimulation;
  flight.file = ReadFilePath(map, "config");
  flight.name = ReadName(map, "name", flight.file.stem().string());
  flight.randomise = map.Get<bool>("randomise", false);
  flight.settings = ReadSettings(map.ChildOrEmpty("overrides"));
  flight.options = ReadOptions(map);
  flight.line = map.LineOf("config");
  map.Finish();
  return flight;
}

FlightSource ReadLog(const YamlMap& map) {
  FlightSource flight;
  if (map.Has("log") == map.Has("map")) map.Fail("log", "give either 'log', or 'map' and 'in'");
  if (map.Has("log")) {
    flight.kind = FlightKind::kNativeLog;
    flight.file = ReadFolderPath(map, "log");
    flight.name = ReadName(map, "name", flight.file.filename().string());
  } else {
    flight.kind = FlightKind::kForeignLog;
    flight.file = ReadFilePath(map, "map");
    for (const auto& input : map.Get<std::vector<std::string>>("in")) {
      flight.inputs.push_back(ReadPath(map, "in", input).string());
    }
    if (flight.inputs.empty()) map.Fail("in", "needs the paths of the log's files");
    flight.name = ReadName(map, "name", fs::path(flight.inputs.front()).stem().string());
    flight.settings = ReadSettings(map.ChildOrEmpty("fixes"));
  }
  flight.options = ReadOptions(map);
  flight.line = map.LineOf(map.Has("log") ? "log" : "map");
  map.Finish();
  return flight;
}

// Filters do not depend on gamma and run once, at the paper's 3 if that is listed.
int GammaOfFilter(const std::vector<int>& gammas) {
  return std::find(gammas.begin(), gammas.end(), 3) != gammas.end() ? 3 : gammas.front();
}

EstimatorSource ReadEstimator(const YamlMap& map, const std::vector<int>& gammas) {
  EstimatorSource estimator;
  estimator.name = map.Get<std::string>("name");
  try {
    FindEstimator(estimator.name);
  } catch (const InputError& error) {
    map.Fail("name", error.what());
  }
  estimator.label = ReadName(map, "label", estimator.name);
  if (map.Has("config")) estimator.file = ReadFilePath(map, "config");
  estimator.options = ReadOptions(map);
  estimator.gammas = ReadGammas(map, gammas);
  if (!FindEstimator(estimator.name).windows) estimator.gammas = {GammaOfFilter(estimator.gammas)};
  estimator.line = map.LineOf("name");
  map.Finish();
  return estimator;
}

void CheckRoot(const YamlMap& map, const std::string& key, const std::string& path) {
  for (const char* root : {"simulation.", "fixes.", "options."}) {
    if (path.rfind(root, 0) == 0 && path.size() > std::string(root).size()) return;
  }
  map.Fail(key, fmt::format("'{}' must begin with simulation., fixes. or options.", path));
}

std::vector<SweepPoint> ReadValues(const YamlMap& map) {
  const auto keys = map.Get<std::vector<std::string>>("keys");
  for (const std::string& key : keys) CheckRoot(map, "keys", key);
  const YAML::Node nodes = map.RawNode("values");
  const auto values = map.Get<std::vector<double>>("values");
  std::vector<SweepPoint> points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    SweepPoint point{values[i], {}};
    for (const std::string& key : keys) {
      point.settings.push_back({key, nodes[i], map.LineOf("values")});
    }
    points.push_back(point);
  }
  return points;
}

std::vector<SweepPoint> ReadPoints(const YamlMap& map) {
  std::vector<SweepPoint> points;
  for (const YamlMap& entry : map.Children("points")) {
    const YamlMap set = entry.Child("set");
    SweepPoint point{entry.Get<double>("x"), ReadSettings(set)};
    for (const Setting& setting : point.settings) CheckRoot(set, setting.path, setting.path);
    entry.Finish();
    points.push_back(point);
  }
  return points;
}

Sweep ReadSweep(const YamlMap& map) {
  Sweep sweep;
  if (map.Keys().empty()) return sweep;
  sweep.name = ReadName(map, "name");
  sweep.unit = map.Get<std::string>("unit", "1");
  if (map.Has("points") == map.Has("keys")) {
    map.Fail("points", "give either 'keys' and 'values', or 'points'");
  }
  sweep.points = map.Has("points") ? ReadPoints(map) : ReadValues(map);
  map.Finish();
  if (sweep.points.empty()) map.Fail("values", "needs at least one value");
  return sweep;
}

void ReadSeeds(const YamlMap& map, Experiment* experiment) {
  experiment->first_seed = map.Get<std::uint64_t>("first", 1);
  experiment->seeds = map.Get<int>("count", 1);
  if (experiment->seeds < 1) map.Fail("count", "needs at least one seed");
  map.Finish();
}

std::vector<double> ReadForecast(const YamlMap& map) {
  const auto horizons = map.Get<std::vector<double>>("forecast", {});
  for (const double horizon : horizons) {
    if (!(horizon > 0.0)) map.Fail("forecast", "horizons must be above zero");
  }
  return horizons;
}

bool HasSimulation(const Experiment& experiment) {
  return std::any_of(experiment.flights.begin(), experiment.flights.end(),
                     [](const FlightSource& f) { return f.kind == FlightKind::kSimulation; });
}

// A quantity that no flight can give would be missing from the result without a word.
void CheckQuantity(const YamlMap& map, const std::string& quantity, const Experiment& experiment) {
  const std::vector<std::string> parameters = ParametersWithTruth();
  if (quantity == kFinalPointError) return;
  if (std::find(parameters.begin(), parameters.end(), quantity) == parameters.end()) {
    map.Fail(quantity, fmt::format("no such quantity; known here: {}, {}", kFinalPointError,
                                   fmt::join(parameters, ", ")));
  }
  if (!HasSimulation(experiment)) {
    map.Fail(quantity, fmt::format("only simulated flights have a true value of a parameter; add "
                                   "one under 'simulations', or name only {}",
                                   kFinalPointError));
  }
}

void ReadConvergence(const YamlMap& map, Experiment* experiment) {
  for (const std::string& quantity : map.Keys()) {
    CheckQuantity(map, quantity, *experiment);
    const double tolerance = map.Get<double>(quantity);
    if (!(tolerance > 0.0)) map.Fail(quantity, "the tolerance must be above zero");
    experiment->convergence[quantity] = tolerance;
  }
  map.Finish();
}

void ReadBound(const YamlMap& map, Experiment* experiment) {
  experiment->bound = map.Get<std::string>("bound", "");
  if (experiment->bound.empty()) return;
  for (const EstimatorSource& estimator : experiment->estimators) {
    if (estimator.label == experiment->bound && estimator.name == "vgd") return;
  }
  map.Fail("bound", "must be the label of an estimator 'vgd', whose model gives the bound");
}

void RequireUniqueNames(const YamlMap& map, const Experiment& experiment) {
  std::set<std::string> labels, flights;
  for (const EstimatorSource& estimator : experiment.estimators) {
    if (labels.insert(estimator.label).second) continue;
    throw ErrorAt(map.file(), estimator.line,
                  fmt::format("label '{}' is used twice; give each its own", estimator.label));
  }
  for (const FlightSource& flight : experiment.flights) {
    if (flights.insert(flight.name).second) continue;
    throw ErrorAt(map.file(), flight.line,
                  fmt::format("flight '{}' is named twice; give each its own name", flight.name));
  }
}

}  // namespace

std::vector<fs::path> FilesOf(const FlightSource& source) {
  if (source.kind != FlightKind::kNativeLog) {
    std::vector<fs::path> files{source.file};
    for (const std::string& input : source.inputs) {
      if (!fs::is_directory(input)) {
        files.push_back(input);
        continue;
      }
      const auto first = static_cast<long>(files.size());
      for (const auto& entry : fs::recursive_directory_iterator(input)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
      }
      std::sort(files.begin() + first, files.end());
    }
    return files;
  }
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(source.file)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Experiment ReadExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  Experiment experiment;
  experiment.file = file.string();
  experiment.config = YAML::LoadFile(file.string());
  experiment.name = map.Get<std::string>("name", file.stem().string());
  experiment.about = map.Get<std::string>("about", "");
  for (const YamlMap& entry : map.Children("simulations")) {
    experiment.flights.push_back(ReadSimulation(entry));
  }
  for (const YamlMap& entry : map.Children("logs")) experiment.flights.push_back(ReadLog(entry));
  if (experiment.flights.empty()) map.Fail("simulations", "give 'simulations' or 'logs', or both");
  const std::vector<int> gammas = ReadGammas(map, {3});
  for (const YamlMap& entry : map.Children("estimators")) {
    experiment.estimators.push_back(ReadEstimator(entry, gammas));
  }
  if (experiment.estimators.empty()) map.Fail("estimators", "name at least one, as {name: vgd}");
  ReadSeeds(map.ChildOrEmpty("seeds"), &experiment);
  experiment.sweep = ReadSweep(map.ChildOrEmpty("sweep"));
  const YamlMap starts = map.ChildOrEmpty("starts");
  experiment.starts = starts.Get<int>("count", 0);
  if (experiment.starts < 0) starts.Fail("count", "must be 0 or more");
  starts.Finish();
  experiment.forecast = ReadForecast(map);
  ReadConvergence(map.ChildOrEmpty("convergence"), &experiment);
  experiment.trajectories = map.Get<bool>("trajectories", false);
  ReadBound(map, &experiment);
  map.Finish();
  RequireUniqueNames(map, experiment);
  return experiment;
}

void ShortenExperiment(Experiment* experiment) {
  experiment->seeds = 1;
  experiment->starts = std::min(experiment->starts, 2);
  auto& points = experiment->sweep.points;
  if (points.size() > 2) points = {points.front(), points.back()};
  for (FlightSource& flight : experiment->flights) {
    if (flight.kind != FlightKind::kSimulation) continue;
    flight.settings.push_back({"duration", YAML::Node(30.0), flight.line});
  }
}

}  // namespace trueline
