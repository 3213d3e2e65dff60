// YAML -> SimulationConfig. Every key but `course` may be left out and keeps the default of
// config.h.
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/simulation/config_values.h"
#include "problems/simulation/effects.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/variant.h"

namespace trueline {
namespace simulation {
namespace {

void ReadRandomise(const YamlMap& map, SimulationConfig* config) {
  std::vector<std::string> known;
  for (const auto& [name, value] : TunableValues(*config)) known.push_back(name);
  for (const std::string& key : map.Keys()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      map.Fail(key,
               fmt::format("can't be drawn at random; use one of: {}", fmt::join(known, ", ")));
    }
    const auto range = map.Get<std::vector<double>>(key);
    if (range.size() != 2 || range[1] < range[0]) map.Fail(key, "needs a range [low, high]");
    config->randomise[key] = {range[0], range[1]};
  }
}

}  // namespace
}  // namespace simulation

SimulationConfig ReadSimulationConfig(const YamlMap& map) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  SimulationConfig config;
  YamlArchive a(map);
  a.Value("name", &config.name);
  a.Positive("duration", &config.duration);
  a.Require(config.duration <= kLongestFlight, "duration",
            fmt::format("must be at most {} s", kLongestFlight));
  a.NotNegative("warm_up", &config.warm_up);
  a.Positive("gravity", &config.gravity);
  config.course = ReadCourse(map.Child("course"));
  config.vehicle = ReadVehicle(map.ChildOrEmpty("vehicle"), config.gravity);
  a.Nested("autopilot", &config.autopilot);
  a.Nested("turbulence", &config.turbulence);
  a.Nested("imu", &config.imu);
  a.Nested("ahrs", &config.ahrs);
  a.Nested("detector", &config.detector);
  a.Nested("gnss", &config.gnss);
  Serialize(&a, &config.sensors);
  if (map.Has("detector") && config.gnss.rate > 0.0) {
    map.Fail("detector", "is of the gates' camera, which a flight with gnss lacks; leave it out");
  }
  ReadActingEffects(map, ActorsOf(config), &config.effects);
  config.forces = ReadUnnamedForces(map, &config.terms);
  ReadRandomise(map.ChildOrEmpty("randomise"), &config);
  map.Finish();
  return config;
}

}  // namespace trueline
