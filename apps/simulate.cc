// trueline-simulate: a flight round a course of gates, as a native log with its truth beside it.
#include "problems/simulation/simulate.h"

#include <fmt/format.h>

#include <cmath>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/common/result_folder.h"
#include "problems/common/units.h"
#include "problems/experiment/overlay.h"
#include "problems/log/native_log.h"
#include "problems/simulation/config.h"
#include "problems/simulation/simulate_rotor_flight.h"

DEFINE_string(config, "", "Course, vehicle, sensors and effects (YAML), as in config/simulate/");
DEFINE_string(out, "", "Directory for the native log; DIR.truth.yaml is written beside it");
DEFINE_uint64(seed, 0, "Seed of all noise; the same seed gives the same bytes");
DEFINE_double(duration, 0.0, "Length of the log in s, instead of the configuration's");
DEFINE_string(model, "",
              "model.yaml whose vehicle and effects are flown on the configuration's course");
DEFINE_string(overrides, "", "YAML that replaces keys of the configuration, by their key paths");
DEFINE_bool(randomise, false, "Draw true parameters from the configuration's 'randomise' ranges");
DEFINE_bool(quiet, false, "Print nothing");

namespace trueline {
namespace {

constexpr char kUsage[] = R"(Flies a drone round a course of gates and writes its log.

  trueline simulate --config=config/simulate/hippodrome.yaml --out=/tmp/flight
      100 s of the hippodrome; /tmp/flight is a native log, /tmp/flight.truth.yaml the truth.
  trueline simulate --config=config/simulate/hippodrome.yaml --out=/tmp/flight7 --seed=7 --randomise
      another drone of the same kind: drag, biases and misalignment drawn from the stated ranges.
  trueline simulate --config=config/rotors/random.yaml --out=/tmp/flight
      a flight along a trajectory, with rotor speeds and poses, for --drive=rotors

  trueline simulate --config=config/simulate/gnss.yaml --out=/tmp/flight
      --overrides="gnss.latency: 0, effects: [{id: wind, w_x: 1.5, w_y: -1}]"
      with another receiver, and an effect that calibration does not model; trueline effects lists
      the effects

Then: trueline calibrate --log=/tmp/flight --out=/tmp/result)";

void PrintTable(const FlightLog& log, const SimulationTruth& truth) {
  fmt::print("{:<22} {:>10} {:>10}\n", "stream", "samples", "Hz");
  ForEachStream(log, [&](const Stream& stream, const auto& samples) {
    if (samples.empty()) return;
    fmt::print("{:<22} {:>10} {:>10.1f}\n", stream.name, samples.size(),
               static_cast<double>(samples.size()) / truth.config.duration);
  });
  fmt::print("\n{:<22} {:>10.2f}\n", "laps", truth.laps);
  fmt::print("{:<22} {:>10}\n", "passes", truth.passes);
  fmt::print("{:<22} {:>10.2f} (largest {:.2f})\n", "speed [m/s]", truth.speed_mean,
             truth.speed_max);
  fmt::print("{:<22} {:>10.3f} (largest {:.3f})\n", "off the course [m]", truth.path_error_rms,
             truth.path_error_max);
  fmt::print("{:<22} {:>10.2f} (largest {:.2f})\n", "AHRS tilt error [deg]",
             truth.tilt_error_rms / kDegree, truth.tilt_error_max / kDegree);
}

// If the run is killed, a log must not stand beside the truth of another: the old truth file is
// removed before the new log is in place.
void Store(const FlightLog& log, const std::string& truth, ResultFolder* out) {
  WriteNativeLog(log, out->path());
  AtomicFile truth_file(TruthPath(FLAGS_out));
  truth_file.stream() << truth;
  std::error_code none_yet;
  std::filesystem::remove(TruthPath(FLAGS_out), none_yet);
  out->Commit(FLAGS_quiet);
  truth_file.Commit();
}

int RunRotorFlight(const YamlMap& map) {
  if (!FLAGS_model.empty() || FLAGS_randomise || FLAGS_duration != 0.0) {
    throw InputError(FLAGS_config +
                     ": --model, --randomise and --duration are for gate courses; a rotor-driven "
                     "flight states its effects, vehicle and trajectory in its configuration");
  }
  const RotorFlightConfig config = ReadRotorFlight(map);
  if (!config.warning.empty()) WarnAll({config.warning}, FLAGS_quiet);
  ResultFolder out(FLAGS_out, NativeLogFiles());  // fails before the work
  RotorTruth truth;
  const FlightLog log = SimulateRotorFlight(config.simulation, config.path, FLAGS_seed, &truth);
  Store(log, TruthYaml(truth, config.simulation, FLAGS_seed, FLAGS_config), &out);
  if (!FLAGS_quiet) {
    fmt::print("{} IMU samples, {} poses; {:.3f} m off the trajectory (RMS)\n", log.imu.size(),
               log.pose.size(), truth.path_error_rms);
  }
  return kExitDone;
}

FlightLog SimulateWithProgress(const SimulationConfig& config, SimulationTruth* truth) {
  Progress progress(static_cast<int>(config.duration), "s of flight", FLAGS_quiet);
  return Simulate(config, FLAGS_seed, truth,
                  [&](double t) { progress.Reached(static_cast<int>(t)); });
}

YamlMap Configuration() {
  YamlMap file = YamlMap::FromFile(FLAGS_config);
  if (FLAGS_overrides.empty()) return file;
  try {
    const YamlMap overrides(YAML::Load("{" + FLAGS_overrides + "}"), "--overrides", "");
    return YamlMap(WithSettings(YAML::LoadFile(FLAGS_config), ReadSettings(overrides)),
                   FLAGS_config + " with --overrides", "");
  } catch (const YAML::Exception& error) {
    throw InputError("--overrides: " + error.msg + "; write YAML, such as gnss.latency: 0");
  }
}

int Run() {
  if (FLAGS_config.empty() || FLAGS_out.empty()) {
    throw InputError("--config and --out are needed; see trueline simulate --help");
  }
  const YamlMap map = Configuration();
  if (IsRotorFlight(map)) return RunRotorFlight(map);
  SimulationConfig config = ReadSimulationConfig(map);
  if (!(FLAGS_duration >= 0.0 && FLAGS_duration <= kLongestFlight)) {
    throw InputError(fmt::format("--duration must lie between 0 and {} s", kLongestFlight));
  }
  if (FLAGS_duration > 0.0) config.duration = FLAGS_duration;
  if (!FLAGS_model.empty()) config = WithModel(config, YamlMap::FromFile(FLAGS_model));
  if (FLAGS_randomise) config = DrawVariant(config, FLAGS_seed);
  if (FLAGS_randomise && config.randomise.empty()) {
    WarnAll({FLAGS_config + ": --randomise draws nothing, as `randomise` states no ranges"},
            FLAGS_quiet);
  }
  ResultFolder out(FLAGS_out, NativeLogFiles());
  SimulationTruth truth;
  const FlightLog log = SimulateWithProgress(config, &truth);
  Store(log, TruthYaml(truth, FLAGS_config), &out);
  if (!FLAGS_quiet) PrintTable(log, truth);
  return kExitDone;
}

}  // namespace
}  // namespace trueline

TRUELINE_VERB("simulate", trueline::kUsage, trueline::Run);
