#include "problems/observability/gramian_ranking.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/inspection/first_look.h"
#include "problems/observability/design_score.h"
#include "problems/observability/flight_from_log.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/result/yaml_text.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;

// A vehicle with what is asked about its flights.
struct RankingQuestion {
  RotorVehicle vehicle;
  RotorDrivenSystem system;
  DesignTarget target;
};

DesignTarget TargetOf(const RotorDrivenSystem& system, const RankingOptions& options) {
  DesignTarget target =
      TargetOf(system, options.show, options.free, options.weigh_by_noise,
               [](const char*, const std::string& text) { throw InputError("e2log: " + text); });
  AddStates(target.interest, &target.asked);
  return target;
}

// Flight: RotorFlight or NominalFlight.
template <class Flight>
RankedFlight ScoreOf(const std::string& name, double duration, const Flight& flight,
                     const RankingQuestion& question, const RankingOptions& options) {
  const RotorDrivenSystem& system = question.system;
  const DesignTarget& target = question.target;
  RankedFlight ranked{name, duration, {}, {}};
  const Eigen::MatrixXd gramian = E2log(system, flight, target.weights, options.e2log);
  ranked.scores = ScoreStates(gramian, target.interest,
                              options.marginalise ? target.asked : target.interest, target.scale);
  E2logOptions exact = options.e2log;
  exact.chained = true;
  const Eigen::MatrixXd information = E2log(system, flight, system.OutputWeights(), exact);
  ranked.sigma = SigmasOf(Assess(information, target.asked, system.errors()), target.interest);
  return ranked;
}

class Ranker {
 public:
  Ranker(const RankingInputs& inputs, const std::function<void(const std::string&)>& progress)
      : inputs_(inputs), progress_(progress) {}

  Ranking Run() {
    if (inputs_.config) ReadConfig(*inputs_.config);
    for (const fs::path& file : inputs_.trajectories) {
      if (!question_) {
        throw InputError(
            fmt::format("{}: a trajectory needs a vehicle; give --config with the key "
                        "'vehicle'",
                        file.string()));
      }
      ScorePath(file.string(), ReadTrajectoryFile(file));
    }
    for (const fs::path& log : inputs_.logs) ScoreLog(log);
    if (ranking_.flights.empty()) {
      throw InputError(
          "nothing to score: give --trajectory, --log, or a --config whose 'cases' "
          "have a trajectory");
    }
    std::stable_sort(ranking_.flights.begin(), ranking_.flights.end(),
                     [](auto& a, auto& b) { return a.scores.sigma_min > b.scores.sigma_min; });
    for (const int state : question_->target.interest) {
      ranking_.shown.push_back(question_->system.errors()[state]);
      ranking_.scale.push_back(question_->target.scale[state]);
    }
    return std::move(ranking_);
  }

 private:
  void ReadConfig(const YamlMap& config) {
    config.GetChoice("system", {"rotor_driven"}, "rotor_driven");
    config.Get<double>("horizon", 0.0);  // of observability alone
    limits_ = ReadLimits(config.ChildOrEmpty("limits"));
    ranking_.options = FromYaml<RankingOptions>(config.ChildOrEmpty("e2log"));
    stated_ = config.ChildOrEmpty("sensors");
    const RotorVehicle vehicle =
        ReadRotorVehicle(config.Child("vehicle"), config.Get<double>("gravity", 9.81));
    Ask(vehicle,
        WithSensors(FromYaml<SensorSet>(*stated_), ranking_.options.sensors, config, "e2log"));
    for (const YamlMap& map : config.Children("cases")) {
      if (!map.Has("trajectory")) continue;
      ScorePath(map.Get<std::string>("name"),
                ReadTrajectory(map.Child("trajectory"), vehicle, limits_));
    }
    config.Finish();
  }

  // Columns are scaled once, by the first vehicle: flights are compared by the same scale.
  void Ask(const RotorVehicle& vehicle, const SensorSet& sensors) {
    if (progress_) progress_("scale of the columns");
    ranking_.options.scale.limits = limits_;
    question_ = RankingQuestion{vehicle, RotorDrivenSystem(vehicle.model, sensors), {}};
    DesignTarget& target = question_->target;
    target = TargetOf(question_->system, ranking_.options);
    target.scale =
        FindColumnScale(question_->system, vehicle, target.asked, ranking_.options.scale);
  }

  void ScorePath(const std::string& name, const PiecewisePolynomial& path) {
    if (progress_) progress_(name);
    const RotorFlight flight(question_->vehicle, path);
    const std::string warning = LimitWarning(name, flight, limits_);
    if (!warning.empty()) ranking_.warnings.push_back(warning);
    ranking_.flights.push_back(
        ScoreOf(name, path.duration(), flight, *question_, ranking_.options));
  }

  // The question about one log: it is asked by the log's own rates, where the configuration does
  // not state others.
  RankingQuestion AboutLog(const FlightLog& log) const {
    const SensorSet& asked = question_->system.sensors();
    SensorSet sensors = SensorsOf(log);
    if (stated_) FromYaml(*stated_, &sensors);
    sensors.imu = asked.imu, sensors.position = asked.position, sensors.pose = asked.pose;
    RankingQuestion question = *question_;
    question.system = RotorDrivenSystem(question.vehicle.model, sensors);
    question.target.weights = TargetOf(question.system, ranking_.options).weights;
    return question;
  }

  void ScoreLog(const fs::path& directory) {
    if (progress_) progress_(directory.string());
    const FlightLog log = ReadAndLook(directory);
    const std::vector<std::string> warnings = WarningsByFlight(std::span(&log, 1));
    ranking_.warnings.insert(ranking_.warnings.end(), warnings.begin(), warnings.end());
    if (!question_) {
      std::string warning;
      const RotorVehicle vehicle = VehicleFromLog(log, &warning);
      if (!warning.empty()) ranking_.warnings.push_back(warning);
      Ask(vehicle, SensorsOf(log));
    }
    const NominalFlight flight = RotorFlightFromLog(log, question_->vehicle);
    ranking_.flights.push_back(ScoreOf(directory.string(), flight.end - flight.start, flight,
                                       AboutLog(log), ranking_.options));
  }

  const RankingInputs& inputs_;
  const std::function<void(const std::string&)>& progress_;
  std::optional<YamlMap> stated_;  // `sensors` of the configuration
  FlightLimits limits_;
  std::optional<RankingQuestion> question_;
  Ranking ranking_;
};

}  // namespace

void Serialize(YamlArchive* a, RankingOptions* o) {
  a->Value("sensors", &o->sensors);
  a->Value("show", &o->show);
  a->Value("free", &o->free);
  a->Require(!o->show.empty(), "show", "names no constant");
  a->Value("order", &o->e2log.order);
  a->Require(o->e2log.order >= 1 && o->e2log.order <= 6, "order", "must be 1 to 6");
  a->Value("segment", &o->e2log.segment);
  a->Require(o->e2log.segment >= 0.02 && o->e2log.segment <= 0.5, "segment",
             "must be in [0.02, 0.5] s");
  a->Choice("segments", &o->e2log.chained, {{"chained", true}, {"summed", false}});
  a->Choice("others", &o->marginalise, {{"marginalised", true}, {"known", false}});
  a->Choice("weighting", &o->weigh_by_noise, {{"noise", true}, {"none", false}});
  Serialize(a, &o->scale);
  a->Value("scale_seed", &o->scale.seed);
}

Ranking RankByE2log(const RankingInputs& inputs,
                    const std::function<void(const std::string&)>& progress) {
  return Ranker(inputs, progress).Run();
}

namespace {

std::string RankText(double value) { return Rounded(value, 4); }

YAML::Node OptionsNode(const RankingOptions& options) {
  YAML::Node node = ToYaml(options);
  node["segment"] = RankText(options.e2log.segment);
  for (const char* list : {"sensors", "show", "free"}) {
    node[list].SetStyle(YAML::EmitterStyle::Flow);
  }
  return node;
}

YAML::Node ByConstant(const std::vector<StateInfo>& shown, const std::vector<double>& values,
                      bool units) {
  YAML::Node node;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    node[shown[i].name] = units ? FlowMap({{"value", RankText(values[i])}, {"unit", shown[i].unit}})
                                : YAML::Node(RankText(values[i]));
  }
  return node;
}

YAML::Node FlightNode(const Ranking& ranking, std::size_t i) {
  const RankedFlight& flight = ranking.flights[i];
  YAML::Node node;
  node["rank"] = i + 1;
  node["name"] = flight.name;
  node["duration"] = FlowMap({{"value", RankText(flight.duration)}, {"unit", "s"}});
  node["sigma_min"] = RankText(flight.scores.sigma_min);
  node["condition"] = RankText(flight.scores.condition);
  node["log10_determinant"] = RankText(flight.scores.log10_determinant);
  node["per_state"] = ByConstant(ranking.shown, flight.scores.per_state, false);
  node["crlb"] = ByConstant(ranking.shown, flight.sigma, true);
  return node;
}

}  // namespace

std::string RankingYaml(const Ranking& ranking, const std::string& source) {
  YAML::Node node;
  node["provenance"]["version"] = Version();
  node["provenance"]["source"] = source;
  node["score"] = "e2log";
  node["options"] = OptionsNode(ranking.options);
  node["column_scale"] = ByConstant(ranking.shown, ranking.scale, true);
  for (std::size_t i = 0; i < ranking.flights.size(); ++i) {
    node["flights"].push_back(FlightNode(ranking, i));
  }
  return TextOf(node);
}

std::string RankingTable(const Ranking& ranking) {
  const RankingOptions& options = ranking.options;
  std::string text = fmt::format(
      "sigma_min of the E2LOG Gramian of {}, order {}, segments of {:g} s {}, other states {}, "
      "outputs weighted by {}, columns scaled by {}\nsigma: Cramer-Rao bound by the sensors' "
      "noise, all states unknown\n\n{:>4}  {:>11} {:>10}",
      fmt::join(options.show, ", "), options.e2log.order, options.e2log.segment,
      options.e2log.chained ? "chained" : "summed",
      options.marginalise ? "marginalised" : "taken as known",
      options.weigh_by_noise ? "noise" : "nothing", ToYaml(options)["scale"].as<std::string>(),
      "rank", "sigma_min", "condition");
  for (const StateInfo& info : ranking.shown) {
    text += fmt::format(" {:>14}", fmt::format("{} [{}]", info.name, info.unit));
  }
  text += "  flight\n";
  for (std::size_t i = 0; i < ranking.flights.size(); ++i) {
    const RankedFlight& flight = ranking.flights[i];
    text += fmt::format("{:>4}  {:>11.4g} {:>10.3g}", i + 1, flight.scores.sigma_min,
                        flight.scores.condition);
    for (const double sigma : flight.sigma) text += fmt::format(" {:>14.3g}", sigma);
    text += "  " + flight.name + "\n";
  }
  return text;
}

}  // namespace trueline
