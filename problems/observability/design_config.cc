#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/calibration/considered.h"
#include "problems/common/yaml_archive.h"
#include "problems/observability/design.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/simulation/simulate_rotor_flight.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

int AtLeast(const YamlMap& map, const std::string& key, int fallback, int least) {
  const int value = map.Get<int>(key, fallback);
  if (value < least) map.Fail(key, fmt::format("must be at least {}", least));
  return value;
}

DesignOptions ReadCommonOptions(const YamlMap& config, std::uint64_t seed, int threads) {
  DesignOptions options;
  options.seed = seed;
  options.threads = threads;
  options.shape.duration = config.Get<double>("duration", options.shape.duration);
  if (!(options.shape.duration >= 2.0 && options.shape.duration <= 120.0)) {
    config.Fail("duration", "must be in [2, 120] s");
  }
  options.shape = SplineShape::Lasting(options.shape.duration);
  options.limits = ReadLimits(config.ChildOrEmpty("limits"));
  return options;
}

void ReadOptimiser(const YamlMap& config, DesignOptions* options) {
  SplineShape& shape = options->shape;
  shape.pieces = AtLeast(config, "pieces", shape.pieces, shape.degree + 1);
  options->candidates = AtLeast(config, "candidates", options->candidates, 1);
  options->random_only = config.GetChoice("start_from", {"random", "random_and_figures"},
                                          "random_and_figures") == "random";
  options->starts = AtLeast(config, "starts", options->starts, 1);
  options->iterations = AtLeast(config, "iterations", options->iterations, 1);
  options->time_limit = config.Get<double>("time_limit", options->time_limit);
}

DesignTarget ReadTarget(const YamlMap& config, const RotorDrivenSystem& system) {
  const auto names = config.Get<std::vector<std::string>>("show");
  const bool by_noise = config.GetChoice("weighting", {"noise", "none"}, "noise") == "noise";
  const DesignTarget target =
      TargetOf(system, names, config.Get<std::vector<std::string>>("free", {}), by_noise,
               [&](const char* key, const std::string& text) { config.Fail(key, text); });
  for (const int state : target.interest) {
    if (std::count(target.asked.begin(), target.asked.end(), state) == 0) {
      config.Fail("show", fmt::format("'{}' is taken as known; name it under 'free' too",
                                      system.errors()[state].name));
    }
  }
  return target;
}

DesignTask ReadGramianTask(const YamlMap& config, const DesignOptions& common) {
  const RotorVehicle vehicle =
      ReadRotorVehicle(config.Child("vehicle"), config.Get<double>("gravity", 9.81));
  const SensorSet noise = FromYaml<SensorSet>(config.ChildOrEmpty("noise"));
  const auto sensors = config.Get<std::vector<std::string>>("sensors", {"imu", "pose"});
  const RotorDrivenSystem system(vehicle.model, WithSensors(noise, sensors, config, "sensors"));
  GramianCriterion gramian{system, ReadTarget(config, system)};
  YamlArchive archive(config);
  Serialize(&archive, &gramian.scale);
  DesignTask task{config.file(), vehicle, {}, common, 0, gramian};
  ReadOptimiser(config, &task.options);
  for (const int state : gramian.target.interest) task.show.push_back(system.errors()[state]);
  return task;
}

DesignTask ReadBoundTask(const YamlMap& config, const DesignOptions& common) {
  const RotorSimulation simulation = ReadRotorFlightVehicle(config);
  BoundDesign bound{simulation,
                    PriorFromVehicle(simulation.vehicle),
                    ReadConsidered(config.ChildOrEmpty("consider")),
                    {},
                    common.shape.duration,
                    1.5};
  bound.seed = common.seed;
  bound.threads = common.threads;
  ReadRotorPrior(config.ChildOrEmpty("prior"), &bound.prior);
  std::vector<StateInfo> shown;
  for (const auto& name : config.Get<std::vector<std::string>>("show")) {
    const int constant = FindRotorConstant(name);
    if (constant < 0) config.Fail("show", "'" + name + "' is no constant of this model");
    if (!(bound.prior.sigma[constant] > 0.0)) {
      config.Fail("show", "'" + name + "' is taken as known; give it a sigma under 'prior'");
    }
    if (std::count(bound.show.begin(), bound.show.end(), constant) > 0) continue;
    bound.show.push_back(constant);
    shown.push_back({name, kRotorConstants[constant].unit});
  }
  YamlArchive(config).NotNegative("ramp", &bound.ramp);
  if (bound.ramp > 0.4 * common.shape.duration) {
    config.Fail("ramp", "must be at most 0.4 of the duration");
  }
  bound.evaluations = AtLeast(config, "evaluations", bound.evaluations, 0);
  bound.candidates = AtLeast(config, "candidates", bound.candidates, 1);
  return {config.file(), simulation.vehicle, shown, common, 0, bound};
}

// True if the file has a key that the Gramian alone takes: it then is the criterion by default.
bool StatesGramianKey(const YamlMap& config) {
  constexpr const char* kKeys[] = {"sensors",    "noise",      "weighting",    "free",
                                   "scale",      "pieces",     "starts",       "iterations",
                                   "time_limit", "start_from", "scale_flights"};
  return std::any_of(std::begin(kKeys), std::end(kKeys),
                     [&](const char* key) { return config.Has(key); });
}

}  // namespace

DesignTask ReadDesignTask(const YamlMap& config, std::uint64_t seed, int threads) {
  const std::string criterion = StatesGramianKey(config) ? "gramian" : "bound";
  const bool by_bound = config.GetChoice("criterion", {"gramian", "bound"}, criterion) == "bound";
  const DesignOptions common = ReadCommonOptions(config, seed, threads);
  DesignTask task = (by_bound ? ReadBoundTask : ReadGramianTask)(config, common);
  if (task.show.empty()) config.Fail("show", "names nothing to show");
  task.compare = AtLeast(config, "compare", 0, 0);
  config.Finish();
  return task;
}

}  // namespace trueline
