#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/log/log_yaml.h"
#include "problems/log/samples.h"
#include "problems/observability/flight_from_log.h"
#include "problems/observability/gramian_ranking.h"
#include "problems/observability/observe.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/trajectory/rotor_flight.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

const std::vector<std::string> kMotions = {"varying", "constant", "hover", "vertical", "straight"};
const std::vector<std::string> kTurnings = {"varying", "constant_heading", "pitching",
                                            "constant_attitude"};

int IndexOf(const std::vector<std::string>& words, const std::string& word) {
  return static_cast<int>(std::find(words.begin(), words.end(), word) - words.begin());
}

// `states` with those named under `free` added and those under `known` taken out.
std::vector<int> AskedStates(const YamlMap& map, std::vector<int> states,
                             const std::vector<StateInfo>& info) {
  const auto find = [&](const std::string& key, const std::string& name) {
    const int state = FindState(info, name);
    if (state >= 0) return state;
    std::vector<std::string> names(info.size());
    for (std::size_t i = 0; i < info.size(); ++i) names[i] = info[i].name;
    map.Fail(key, fmt::format("'{}' is no state; use one of: {}", name, fmt::join(names, ", ")));
  };
  for (const auto& name : map.Get<std::vector<std::string>>("free", {})) {
    AddStates({find("free", name)}, &states);
  }
  for (const auto& name : map.Get<std::vector<std::string>>("known", {})) {
    const int state = find("known", name);
    states.erase(std::remove(states.begin(), states.end(), state), states.end());
  }
  std::sort(states.begin(), states.end());
  if (states.empty()) map.Fail("known", "leaves nothing to ask for");
  return states;
}

void ReadTimes(const YamlMap& map, FlightQuestion* question) {
  question->horizon = map.Get<double>("horizon", question->horizon);
  question->step = map.Get<double>("step", question->step);
  if (!(question->horizon > 0.0)) map.Fail("horizon", "must be positive, in s");
  if (!(question->step > 0.0 && question->step <= 0.1)) map.Fail("step", "must be in (0, 0.1] s");
}

FlightQuestion QuestionOf(const YamlMap& map, const std::string& name, std::vector<int> states,
                          double horizon) {
  FlightQuestion question;
  question.name = name;
  question.flight = map.Has("trajectory")
                        ? map.Child("trajectory").Get<std::string>("kind", "lissajous")
                        : "flight";
  question.states = std::move(states);
  question.horizon = horizon;
  ReadTimes(map, &question);
  return question;
}

// Converts a trajectory in flat outputs to states and inputs of the model of Li et al.
NominalFlight ImuFlight(const RotorFlight& flight) {
  NominalFlight nominal = flight.Nominal();
  nominal.at = [&flight](double t) {
    using Model = RotorDrivenModel;
    const FlatMatrix flat = flight.path().Expand(t, 2);
    const NominalPoint rotor = flight.At(t);
    NominalPoint point{ImuDrivenSystem::Typical(), {}};
    for (int i = 0; i < 6; ++i) point.x[i] = rotor.x[Model::kPosition + i];
    const Eigen::Quaterniond q(rotor.x[0], rotor.x[1], rotor.x[2], rotor.x[3]);
    const Eigen::Matrix3d R = q.toRotationMatrix();
    for (int i = 0; i < 9; ++i) point.u.push_back(R(i / 3, i % 3));
    const Eigen::Vector3d down(0.0, 0.0, flight.vehicle().gravity);
    point.u.push_back(-(down - 2.0 * flat.col(2).head<3>()).norm());
    return point;
  };
  return nominal;
}

class ConfigRun {
 public:
  ConfigRun(const YamlMap& config, const StepNotice& progress)
      : config_(config),
        progress_(progress),
        gravity_(config.Get<double>("gravity", 9.81)),
        rotor_driven_(config.GetChoice("system", {"rotor_driven", "imu_driven"}, "rotor_driven") ==
                      "rotor_driven"),
        vehicle_(ReadRotorVehicle(config.Child("vehicle"), gravity_)),
        noise_(FromYaml<SensorSet>(config.ChildOrEmpty("sensors"))),
        limits_(ReadLimits(config.ChildOrEmpty("limits"))),
        horizon_(config.Get<double>("horizon", rotor_driven_ ? 0.2 : 10.0)) {
    FromYaml<RankingOptions>(config.ChildOrEmpty("e2log"));  // of --score=e2log
  }

  std::vector<CaseResult> Run() {
    std::vector<CaseResult> results;
    for (const YamlMap& map : config_.Children("cases")) {
      const std::string name = map.Get<std::string>("name");
      if (progress_) progress_(name);
      results.push_back(rotor_driven_ ? RotorCase(map, name) : ImuCase(map, name));
      map.Finish();
    }
    if (results.empty()) config_.Fail("cases", "names no case; list at least one");
    config_.Finish();
    return results;
  }

 private:
  CaseResult RotorCase(const YamlMap& map, const std::string& name) {
    RotorVehicle vehicle = vehicle_;
    if (map.Has("rotors"))
      vehicle.model = RotorDrivenModel(ReadRotors(map.Children("rotors")), gravity_);
    const auto sensors = map.Get<std::vector<std::string>>("sensors");
    const RotorDrivenSystem system(vehicle.model, WithSensors(noise_, sensors, map, "sensors"));
    const std::vector<int> states = AskedStates(map, system.PaperStates(), system.errors());
    if (!map.Has("trajectory")) {
      const int motion = IndexOf(kMotions, map.GetChoice("inputs", kMotions, "varying"));
      return ObserveRotorMotion(system, vehicle, name, states, static_cast<Motion>(motion));
    }
    const FlightQuestion question = QuestionOf(map, name, states, horizon_);
    const RotorFlight flight = FlightOf(map, vehicle);
    CaseResult result = ObserveFlight(system, flight.Nominal(), question);
    WarnOfLimits(flight, &result);
    if (map.Get<bool>("advice", true)) {
      AdviseRotorFlight(system, vehicle, flight.Nominal(), question, limits_, &result);
    }
    return result;
  }

  CaseResult ImuCase(const YamlMap& map, const std::string& name) {
    const ImuDrivenSystem system(gravity_, noise_.pose_rate, noise_.sigma_position);
    const std::vector<int> states = AskedStates(map, system.AllStates(), system.errors());
    if (!map.Has("trajectory")) {
      const int turning = IndexOf(kTurnings, map.GetChoice("inputs", kTurnings, "varying"));
      return ObserveImuMotion(system, name, states, static_cast<Turning>(turning));
    }
    const FlightQuestion question = QuestionOf(map, name, states, horizon_);
    const RotorFlight flight = FlightOf(map, vehicle_);
    return ObserveFlight(system, ImuFlight(flight), question);
  }

  RotorFlight FlightOf(const YamlMap& map, const RotorVehicle& vehicle) const {
    return {vehicle, ReadTrajectory(map.Child("trajectory"), vehicle, limits_)};
  }

  void WarnOfLimits(const RotorFlight& flight, CaseResult* result) const {
    const std::string warning = LimitWarning(result->name, flight, limits_);
    if (!warning.empty()) result->warnings.push_back(warning);
  }

  const YamlMap& config_;
  StepNotice progress_;
  double gravity_;
  bool rotor_driven_;
  RotorVehicle vehicle_;
  SensorSet noise_;
  FlightLimits limits_;
  double horizon_;
};

// The configuration's values take the place of the log's. Its keys `system`, `cases` and `e2log`
// are of other runs of the program.
CaseResult AskRotorLog(const FlightLog& log, const std::optional<YamlMap>& config) {
  FlightQuestion question;
  SensorSet sensors = SensorsOf(log);
  FlightLimits limits;  // of advice
  std::string warning;
  std::optional<RotorVehicle> vehicle;
  if (config) {
    config->GetChoice("system", {"rotor_driven"}, "rotor_driven");
    for (const char* other : {"cases", "e2log"}) config->RawNode(other);
    const double gravity = config->Get<double>("gravity", log.gravity);
    vehicle = ReadRotorVehicle(config->Child("vehicle"), gravity);
    limits = ReadLimits(config->ChildOrEmpty("limits"));
    FromYaml(config->ChildOrEmpty("sensors"), &sensors);
    ReadTimes(*config, &question);
    config->Finish();
  } else {
    vehicle = VehicleFromLog(log, &warning);
  }
  sensors.pose = !log.pose.empty() || !log.mocap.empty();
  sensors.position = !sensors.pose && !log.fixes.empty();
  const RotorDrivenSystem system(vehicle->model, sensors);
  const NominalFlight flight = RotorFlightFromLog(log, *vehicle);
  question.name = "rotor_driven";
  question.flight = log.name;
  question.states = system.PaperStates();
  CaseResult result = ObserveFlight(system, flight, question);
  if (!warning.empty()) result.warnings.push_back(warning);
  try {
    AdviseRotorFlight(system, *vehicle, flight, question, limits, &result);
  } catch (const InputError& error) {
    result.warnings.push_back(fmt::format("no advice: {}", error.what()));
  }
  return result;
}

CaseResult AskImuLog(const FlightLog& log) {
  const NominalFlight flight = ImuFlightFromLog(log);
  const double duration = flight.end - flight.start;
  const bool fixes = !log.fixes.empty();
  const auto count = static_cast<double>(fixes ? log.fixes.size() : log.mocap.size());
  const ImuDrivenSystem system(log.gravity, count / duration,
                               fixes ? MedianSigma(log.fixes) : kMocapSigma);
  FlightQuestion question;
  question.name = "imu_driven";
  question.flight = log.name;
  question.states = system.AllStates();
  question.horizon = 10.0;
  CaseResult result = ObserveFlight(system, flight, question);
  if (log.mocap.empty()) {
    result.warnings.emplace_back(
        "imu_driven: velocities are fitted to fixes, and what is left of their error looks like "
        "motion; where the speed hardly changes, sigmas may be several times too small");
  }
  return result;
}

}  // namespace

std::vector<CaseResult> RunObserveConfig(const YamlMap& config, const StepNotice& progress) {
  return ConfigRun(config, progress).Run();
}

std::vector<CaseResult> RunObserveLog(const FlightLog& log, const std::optional<YamlMap>& config,
                                      const StepNotice& progress) {
  std::vector<CaseResult> results;
  if (!log.rotors.empty() && (config || (log.vehicle && !log.vehicle->rotors.empty()))) {
    if (progress) progress("rotor_driven");
    results.push_back(AskRotorLog(log, config));
  } else if (config) {
    throw ErrorAt(
        config->file(), 0,
        "states a vehicle with rotors, and the log has no rotors.csv; leave --config out");
  }
  const bool places = !log.fixes.empty() || !log.mocap.empty();
  if (places && (!log.attitude.empty() || (results.empty() && !log.imu.empty()))) {
    if (progress) progress("imu_driven");
    results.push_back(AskImuLog(log));
  }
  if (results.empty()) {
    throw ErrorAt(log.directory, 0,
                  "neither rotor speeds with a vehicle nor fixes: there is no model "
                  "to ask; add rotors.csv and 'vehicle', or fixes.csv");
  }
  return results;
}

}  // namespace trueline
