#include <algorithm>
#include <set>

#include "problems/calibration/considered.h"
#include "problems/common/yaml_archive.h"
#include "problems/experiment/overlay.h"
#include "problems/experiment/rotor_experiment.h"
#include "problems/simulation/rotor_flight_config.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

FlightKindSource ReadKind(const YamlMap& map) {
  FlightKindSource source;
  source.name = ReadName(map, "name");
  source.kind = map.GetChoice("kind", {"random", "lissajous", "evolved", "file"}, "random");
  if (source.kind == "file") {
    source.file = ReadFilePath(map, "file").string();
  }
  if (source.kind == "evolved") {
    source.evaluations = 1800;
    YamlArchive(map).Count("evaluations", &source.evaluations);
  }
  if (source.kind == "lissajous" || source.kind == "evolved") {
    YamlArchive(map).Count("best_of", &source.best_of);
    for (const auto& name :
         map.Get<std::vector<std::string>>("by", {"r_BP_x", "r_BP_y", "r_BP_z"})) {
      source.by.push_back(FindRotorConstant(name));
      if (source.by.back() < 0) map.Fail("by", "'" + name + "' is no constant of this model");
    }
  }
  map.Finish();
  return source;
}

}  // namespace

bool IsRotorExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  return map.Has("drive") && map.Get<std::string>("drive") == "rotors";
}

RotorExperiment ReadRotorExperiment(const std::filesystem::path& file) {
  const YamlMap map = YamlMap::FromFile(file);
  map.GetChoice("drive", {"rotors"}, "rotors");
  RotorExperiment experiment(ReadRotorFlightVehicle(map));
  experiment.file = file.string();
  experiment.config = YAML::LoadFile(file.string());
  experiment.name = map.Get<std::string>("name");
  experiment.about = map.Get<std::string>("about", std::string());
  YamlArchive a(map);
  a.Positive("duration", &experiment.duration);
  a.Require(experiment.duration >= 2.0, "duration", "must be 2 s or more");
  a.Count("flights", &experiment.flights);
  a.Value("seed", &experiment.seed);
  a.Value("passes", &experiment.passes);
  a.Require(experiment.passes >= 0, "passes", "must be 0 or more");
  a.Value("learn_noise", &experiment.learn_noise);
  a.Value("learn_delays", &experiment.learn_delays);
  a.Value("widen", &experiment.widen);
  experiment.unmodelled = ReadConsidered(map.ChildOrEmpty("unmodelled"));
  experiment.considered = ReadConsidered(map.ChildOrEmpty("consider"));
  experiment.prior = PriorFromVehicle(experiment.simulation.vehicle);
  ReadRotorPrior(map.ChildOrEmpty("prior"), &experiment.prior);
  experiment.believed = experiment.simulation.noise;
  a.Nested("noise", &experiment.believed);
  for (const YamlMap& kind : map.Children("kinds")) experiment.kinds.push_back(ReadKind(kind));
  if (experiment.kinds.empty()) map.Fail("kinds", "names no kind of flight");
  std::set<std::string> names;
  for (const FlightKindSource& kind : experiment.kinds) {
    if (!names.insert(kind.name).second) map.Fail("kinds", "'" + kind.name + "' is named twice");
  }
  map.Finish();
  return experiment;
}

void ShortenRotorExperiment(RotorExperiment* experiment) {
  experiment->flights = 2;
  experiment->duration = 5.0;
  experiment->learn_noise = false;
  for (FlightKindSource& kind : experiment->kinds) {
    kind.best_of = 3;
    kind.evaluations = std::min(kind.evaluations, 24);
  }
}

}  // namespace trueline
