// trueline-calibrate: a flight log in, the calibrated model with its uncertainties out.
#include <fmt/format.h>

#include "apps/main/flags.h"
#include "problems/calibration/calibration.h"
#include "problems/calibration/calibration_config.h"
#include "problems/calibration/without_poses.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/progress.h"
#include "problems/common/result_folder.h"
#include "problems/diagnosis/unmodelled_wind.h"
#include "problems/inspection/first_look.h"
#include "problems/log/native_log.h"
#include "problems/result/render.h"
#include "problems/result/yaml_text.h"

DEFINE_string(log, "",
              "the flight: a native log directory; further ones of the same vehicle, separated by "
              "commas, join in the smoother's whole-flight solution");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_string(drive, "imu", "what drives the model: imu (fixes) or rotors (rotor speeds)");
DEFINE_string(estimator, "vgd", "estimators to run, separated by commas; the first is reported");
DEFINE_int32(gamma, 0, "passes in a window; 0 takes the configuration's");
DEFINE_string(gamma_sweep, "1,2,3,4,5", "window lengths to compare; empty for none");
DEFINE_string(thrust, "",
              "accelerometer, level_flight or as_published; empty takes the configuration's");
DEFINE_string(config, "", "YAML with options (see config/calibrate/); empty for the defaults");
DEFINE_string(model, "", "model.yaml of an earlier calibration, taken as prior knowledge");
DEFINE_uint64(seed, 0, "stated in the result; calibration itself draws no random numbers");
DEFINE_string(fail_on, "", "end with exit code 4 from this verdict on: poor or unusable");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(show_config, false, "print every option with its value, and stop");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Calibrates the model of a drone from a flight log.

  trueline calibrate --log=flight --out=result
      fits drag, IMU misalignment, attitude error and bias over the last 3 passes,
      predicts every blind arc, prints the table and writes result/report.html
  trueline convert --in=flight.ulg --out=flight && trueline calibrate --log=flight --out=result
      the same of a flight without gates (GNSS, mocap): arcs are made by withholding fixes
  trueline calibrate --log=flight --out=result --gamma=4 --thrust=level_flight
      a longer window, for a vehicle whose accelerometer is useless
  trueline calibrate --log=flight --out=result --config=config/calibrate/paper.yaml
      the fit as Li et al. 2019 describe it
  trueline calibrate --log=flight,flight2 --out=result --estimator=smoother
      all of both flights of one vehicle at once; they share its drag and misalignment
  trueline calibrate --log=flight2 --out=result2 --model=result/model.yaml
      starts from what an earlier flight of the same vehicle showed
  trueline calibrate --drive=rotors --log=flight --out=result --config=config/calibrate/rotors.yaml
      mass, inertia, centre of mass, sensor positions and biases from rotor speeds, IMU and poses;
      of a log without positions the motors' lag, thrust, and inertia beside the stated mass
  trueline calibrate --show_config > mine.yaml
      every option with its value, to copy, change and give with --config; their meaning stands in
      config/reference/options.md

Exit codes: 0 done, 2 bad input or usage, 3 nothing usable in this flight, 4 refused by --fail_on,
1 a defect.)";

trueline::FailOn Refused() { return trueline::FailOn(FLAGS_fail_on, {"poor", "unusable"}); }

trueline::Calibration Fit(const trueline::FlightLog& log,
                          const std::vector<trueline::FlightLog>& others,
                          const trueline::CalibrationOptions& options) {
  const auto runs = static_cast<int>(trueline::PlanRuns(options).size());
  trueline::Progress progress(runs, "fits of the flight", FLAGS_quiet);
  return trueline::Calibrate(log, options, others, [&] { progress.Done(); });
}

int ExitOf(const trueline::Verdict& verdict) {
  return Refused().ExitFor(
      verdict.word, verdict.word == "unusable" ? trueline::kExitNoResult : trueline::kExitDone);
}

// Judges the log by what the calibration has estimated, writes the files of either drive and the
// report `page`. Returns the exit code.
template <class Calibration>
int Finish(const trueline::FlightLog& log, const std::vector<trueline::LogFault>& faults,
           const YAML::Node& provenance, const char* page, const std::vector<std::string>& more,
           Calibration* calibration, trueline::ResultFolder* out) {
  trueline::JudgeLog(log, faults, trueline::DelaysOf(*calibration), &calibration->verdict);
  trueline::WarnAll(calibration->warnings, FLAGS_quiet);
  trueline::WriteCalibration(*calibration, log, provenance, out->path());
  trueline::Publish(page, FLAGS_report, FLAGS_quiet, trueline::CalibrationTable(*calibration), out,
                    more);
  return ExitOf(calibration->verdict);
}

trueline::CalibrationOptions ImuOptions() {
  return trueline::ResolveCalibrationOptions(
      {FLAGS_config, FLAGS_model, FLAGS_estimator, FLAGS_gamma_sweep, FLAGS_thrust, FLAGS_gamma});
}

int RunImu() {
  trueline::CalibrationOptions options = ImuOptions();
  trueline::ResultFolder out(FLAGS_out, "trueline-calibrate");  // fails before the work
  std::vector<trueline::LogFault> faults;
  std::vector<trueline::FlightLog> logs =
      trueline::ReadFlights(trueline::SplitPaths(FLAGS_log), &faults, trueline::ForDrive::kImu);
  trueline::LimitModelTo(logs, FLAGS_model, &options);
  const trueline::FlightLog log = std::move(logs.front());
  logs.erase(logs.begin());
  trueline::CheckOtherLogs(logs, options);
  trueline::Calibration calibration = Fit(log, logs, options);
  trueline::JudgeWind(log, options, &calibration);
  const trueline::NativeFolder drawn(log, FLAGS_report);
  return Finish(log, faults, trueline::Provenance(log, FLAGS_seed, trueline::ToYaml(options), logs),
                "calibration", {"--log=" + drawn.path()}, &calibration, &out);
}

// Refuses flags that only the IMU drive reads.
void RefuseFlagsOfImuDrive() {
  for (const char* name : {"estimator", "gamma", "gamma_sweep", "thrust"}) {
    const trueline::Flag& flag = this_verb.Find(name);
    if (flag.value == flag.initial) continue;
    throw trueline::InputError(fmt::format("--{}={}: is for --drive=imu; leave it out", name,
                                           trueline::TextOf(flag.value)));
  }
}

// Of a log without positions. There is no page.
int FinishWithoutPoses(const trueline::FlightLog& log,
                       const trueline::RotorCalibrationOptions& options,
                       trueline::ResultFolder* out) {
  const trueline::PoselessCalibration calibration = trueline::CalibrateWithoutPoses(log, options);
  trueline::WarnAll(log.warnings, FLAGS_quiet);
  trueline::WriteCalibration(
      calibration, trueline::Provenance(log, FLAGS_seed, trueline::ToYaml(options)), out->path());
  trueline::Publish("rotors", false, FLAGS_quiet, trueline::CalibrationTable(calibration), out);
  return ExitOf(calibration.verdict);
}

int RunRotors() {
  RefuseFlagsOfImuDrive();
  if (trueline::SplitPaths(FLAGS_log).size() > 1) {
    throw trueline::InputError("--log: --drive=rotors takes one flight");
  }
  trueline::ResultFolder out(FLAGS_out, "trueline-calibrate");
  std::vector<trueline::LogFault> faults;
  const trueline::FlightLog log =
      trueline::ReadAndLook(FLAGS_log, &faults, trueline::ForDrive::kRotors);
  const trueline::RotorCalibrationOptions options =
      trueline::ResolveRotorOptions(FLAGS_config, FLAGS_model, log);
  if (!trueline::HasPositions(log)) return FinishWithoutPoses(log, options, &out);
  trueline::RotorCalibration calibration = trueline::CalibrateRotors(log, options);
  return Finish(log, faults, trueline::Provenance(log, FLAGS_seed, trueline::ToYaml(options)),
                "rotors", {}, &calibration, &out);
}

// The rotor drive has no defaults without a vehicle: that of the configuration, or of the one that
// ships.
YAML::Node RotorConfig() {
  const std::string config =
      FLAGS_config.empty() ? trueline::FindShared("config/calibrate/rotors.yaml") : FLAGS_config;
  return trueline::ToYaml(
      trueline::ResolveRotorOptions(config, FLAGS_model, trueline::FlightLog()));
}

int ShowConfig() {
  const YAML::Node options = FLAGS_drive == "imu" ? trueline::ToYaml(ImuOptions()) : RotorConfig();
  fmt::print("{}", trueline::TextOf(options));
  return trueline::kExitDone;
}

int Run() {
  if (FLAGS_drive != "imu" && FLAGS_drive != "rotors") {
    throw trueline::InputError("--drive: '" + FLAGS_drive + "' is unknown; use imu or rotors");
  }
  if (FLAGS_show_config) return ShowConfig();
  if (trueline::SplitPaths(FLAGS_log).empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--log and --out are needed; see trueline calibrate --help");
  }
  Refused();  // a word that is not known fails before the work
  return FLAGS_drive == "rotors" ? RunRotors() : RunImu();
}

}  // namespace

TRUELINE_VERB("calibrate", kUsage, Run);
