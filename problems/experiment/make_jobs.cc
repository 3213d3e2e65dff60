#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/experiment/job.h"
#include "problems/import/import_map.h"
#include "problems/result/yaml_text.h"
#include "problems/simulation/config.h"
#include "problems/simulation/simulate.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

// The settings under `root`, with the root removed from their paths.
std::vector<Setting> SettingsUnder(const std::string& root, const std::vector<Setting>& settings) {
  std::vector<Setting> found;
  for (const Setting& setting : settings) {
    if (setting.path.rfind(root, 0) != 0) continue;
    found.push_back({setting.path.substr(root.size()), setting.value, setting.line});
  }
  return found;
}

// Applies settings to a file's content and reads the result; an error that they cause names the
// experiment's line.
template <class Read>
auto ReadWith(const std::vector<Setting>& settings, const YAML::Node& node, const std::string& file,
              const Experiment& experiment, const Read& read) {
  if (settings.empty()) return read(YamlMap(node, file, ""));
  try {
    return read(YamlMap(WithSettings(node, settings), file, ""));
  } catch (const InputError& error) {
    int line = settings.front().line;
    std::string paths;
    for (const Setting& setting : settings) {
      if (std::string(error.what()).find("'" + setting.path + "'") != std::string::npos) {
        line = setting.line;
      }
      paths += (paths.empty() ? "" : ", ") + setting.path;
    }
    throw ErrorAt(experiment.file, line, fmt::format("with {} set: {}", paths, error.what()));
  }
}

SimulationConfig ReadFlight(const FlightSource& source, const SweepPoint& point,
                            const Experiment& experiment) {
  const YAML::Node node = YAML::LoadFile(source.file.string());
  const auto read = [](const YamlMap& map) { return ReadSimulationConfig(map); };
  // Read the file alone first, so that its own errors name its own lines.
  read(YamlMap::FromFile(source.file));
  std::vector<Setting> settings = source.settings;
  for (const Setting& setting : SettingsUnder("simulation.", point.settings))
    settings.push_back(setting);
  return ReadWith(settings, node, source.file.string(), experiment, read);
}

ForeignLog ReadForeign(const FlightSource& source, const SweepPoint& point,
                       const Experiment& experiment) {
  ForeignLog log{ReadImportMap(source.file), source.inputs, {}};
  std::vector<Setting> settings = source.settings;
  for (const Setting& setting : SettingsUnder("fixes.", point.settings))
    settings.push_back(setting);
  if (settings.empty()) return log;
  if (!log.map.fixes_from_mocap) {
    throw ErrorAt(experiment.file, settings.front().line,
                  "the map samples no fixes from mocap, so 'fixes' can't change them");
  }
  const YAML::Node node = YAML::LoadFile(source.file.string())["fixes_from_mocap"];
  log.map.fixes_from_mocap = ReadWith(settings, node, source.file.string(), experiment,
                                      [](const YamlMap& map) { return ReadFixesFromMocap(map); });
  return log;
}

YAML::Node OptionsNode(const EstimatorSource& estimator, const FlightSource& flight,
                       const SweepPoint& point) {
  const YAML::Node file =
      estimator.file.empty() ? YAML::Node() : YAML::LoadFile(estimator.file.string());
  const YAML::Node own = Merge(Merge(file, flight.options), estimator.options);
  return WithSettings(own, SettingsUnder("options.", point.settings));
}

JobEstimator ReadEstimator(const EstimatorSource& estimator, const FlightSource& flight,
                           const SweepPoint& point, const Experiment& experiment) {
  // Read the file alone first, so that its own errors name its own lines. All other nodes come from
  // the experiment and keep its lines.
  if (!estimator.file.empty()) FromYaml<EstimatorOptions>(YamlMap::FromFile(estimator.file));
  const YamlMap options(OptionsNode(estimator, flight, point), experiment.file, "options");
  return {estimator.name, estimator.label, FromYaml<EstimatorOptions>(options), estimator.gammas};
}

std::string FilesText(const FlightSource& source) {
  std::string text;
  for (const fs::path& file : FilesOf(source)) {
    text += fmt::format("{} {}\n", file.filename().string(), Sha256OfFile(file));
  }
  return text;
}

std::string SettingsText(const std::vector<Setting>& settings) {
  std::string text;
  for (const Setting& s : settings) text += fmt::format("{}: {}", s.path, TextOf(s.value));
  return text;
}

// All inputs of a job's result except the seed.
std::string DescriptionOf(const Job& job, const FlightSource& source, const SweepPoint& point,
                          const Experiment& experiment) {
  std::string text = fmt::format("{} {} {} {} {} {} {}\n", job.log, job.sweep_index, job.starts,
                                 job.bound, source.randomise, job.x, FilesText(source));
  text += SettingsText(source.settings) + SettingsText(point.settings);
  for (const double horizon : job.forecast) text += fmt::format("forecast {}\n", horizon);
  for (const auto& [quantity, tolerance] : job.convergence) {
    text += fmt::format("{} {}\n", quantity, tolerance);
  }
  for (std::size_t i = 0; i < job.estimators.size(); ++i) {
    const JobEstimator& estimator = job.estimators[i];
    text += fmt::format("{} {}\n", estimator.name, estimator.label);
    for (const int gamma : estimator.gammas) text += fmt::format("{} ", gamma);
    text += TextOf(ToYaml(estimator.options));
    text += TextOf(OptionsNode(experiment.estimators[i], source, point));
  }
  return text;
}

// The flight of one seed.
JobFlight FlightOf(const JobFlight& flight, const FlightSource& source, std::uint64_t seed) {
  if (const auto* config = std::get_if<SimulationConfig>(&flight); config && source.randomise) {
    return DrawVariant(*config, seed);
  }
  if (const auto* foreign = std::get_if<ForeignLog>(&flight)) {
    ForeignLog copy = *foreign;
    copy.options.seed = seed;
    return copy;
  }
  return flight;
}

bool DrawsNumbers(const JobFlight& flight) {
  if (std::holds_alternative<SimulationConfig>(flight)) return true;
  const auto* foreign = std::get_if<ForeignLog>(&flight);
  return foreign != nullptr && foreign->map.fixes_from_mocap.has_value();
}

JobFlight ReadFlightOf(const FlightSource& source, const SweepPoint& point,
                       const Experiment& experiment) {
  switch (source.kind) {
    case FlightKind::kSimulation:
      return ReadFlight(source, point, experiment);
    case FlightKind::kForeignLog:
      return ReadForeign(source, point, experiment);
    case FlightKind::kNativeLog:
      break;
  }
  return source.file;
}

// Throws if a sweep changes nothing of a flight: its figure would be a level line.
void RequireTouched(const Experiment& experiment, const FlightSource& source,
                    const SweepPoint& point) {
  if (experiment.sweep.points.empty() || !SettingsUnder("options.", point.settings).empty()) return;
  const bool simulated = source.kind == FlightKind::kSimulation;
  if (simulated && !SettingsUnder("simulation.", point.settings).empty()) return;
  const bool foreign = source.kind == FlightKind::kForeignLog;
  if (foreign && !SettingsUnder("fixes.", point.settings).empty()) return;
  throw ErrorAt(experiment.file, source.line,
                fmt::format("the sweep changes nothing of '{}'; leave it out, or add a key under "
                            "simulation. (simulations), fixes. (foreign logs) or options.",
                            source.name));
}

void AddJobs(const Experiment& experiment, const FlightSource& source, int sweep_index,
             std::vector<Job>* jobs) {
  const SweepPoint none{std::numeric_limits<double>::quiet_NaN(), {}};
  const SweepPoint& point =
      experiment.sweep.points.empty() ? none : experiment.sweep.points[sweep_index];
  Job job;
  job.log = source.name;
  job.sweep_index = sweep_index;
  job.x = point.x;
  job.starts = experiment.starts;
  job.forecast = experiment.forecast;
  job.convergence = experiment.convergence;
  job.bound = experiment.bound;
  for (const EstimatorSource& estimator : experiment.estimators) {
    job.estimators.push_back(ReadEstimator(estimator, source, point, experiment));
  }
  RequireTouched(experiment, source, point);
  const JobFlight flight = ReadFlightOf(source, point, experiment);
  const std::string description = DescriptionOf(job, source, point, experiment);
  const int seeds = DrawsNumbers(flight) ? experiment.seeds : 1;
  for (int i = 0; i < seeds; ++i) {
    job.seed = experiment.first_seed + static_cast<std::uint64_t>(i);
    job.flight = FlightOf(flight, source, job.seed);
    job.paths = experiment.trajectories && jobs->empty();
    job.key = KeyOf(fmt::format("{}{} {}", description, job.seed, job.paths));
    jobs->push_back(job);
  }
}

}  // namespace

std::vector<Job> MakeJobs(const Experiment& experiment) {
  const int points = std::max<int>(1, static_cast<int>(experiment.sweep.points.size()));
  std::vector<Job> jobs;
  for (const FlightSource& source : experiment.flights) {
    for (int index = 0; index < points; ++index) AddJobs(experiment, source, index, &jobs);
  }
  return jobs;
}

}  // namespace trueline
