// trueline-diagnose: which effects the calibrated model lacks on a flight, with their sizes.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "apps/main/flags.h"
#include "problems/against/comparison.h"
#include "problems/calibration/calibration_config.h"
#include "problems/calibration/write_calibration.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/result_folder.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/log_faults.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/write_diagnosis.h"
#include "problems/inspection/first_look.h"
#include "problems/result/render.h"

DEFINE_string(log, "", "the flight: a native log directory; further ones, after commas, confirm");
DEFINE_string(against, "", "reference flights of the same vehicle: logs, folders of logs, globs");
DEFINE_string(session, "unknown", "with --against: same, if the flight is of their session");
DEFINE_string(usual_scatter, "0.005,0.007,0.025,0.022",
              "with --against: standard deviations of ln(command) that are usual, within a session "
              "and between sessions, each: common to all channels, of one channel");
DEFINE_string(
    map, "", "the YAML column map of foreign logs; empty: one that ships, or by the names in them");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_string(drive, "imu", "what drives the model: imu (fixes) or rotors (rotor speeds)");
DEFINE_string(fit_to, "fixes", "what the model is fitted to: fixes, or mocap beside them");
DEFINE_string(config, "", "YAML with options (see config/calibrate/); empty for the defaults");
DEFINE_string(model, "", "model.yaml of an earlier calibration, taken as prior knowledge");
DEFINE_double(alpha, 0.01, "chance of naming a cause on a flight that has none");
DEFINE_string(fail_on, "",
              "end with exit code 4 from this verdict on: explained, ambiguous or unexplained");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(quiet, false, "print nothing but errors");
DEFINE_bool(verbose, false, "also print all that was tried, with the size that would have shown");

namespace {

constexpr char kUsage[] = R"(Names what the calibrated model gets wrong on a flight.

  trueline diagnose flight.ulg
      converts the log on the way; the page is flight-diagnose/report.html
  trueline diagnose --log=flight --out=result
      tries every effect of the catalogue; names those that the flight proves, with size, sigma and
      what they are worth on arcs that took no part; result/model.yaml is the better model
  trueline diagnose --log=flight --out=result --fit_to=mocap
      the same with mocap as data, which shows smaller effects
  trueline diagnose --log=flight,flight2 --out=result
      claims only what repeats on the second flight of the same vehicle
  trueline diagnose --log=flight --out=result --verbose
      prints the table of all candidates, too: what was tried, and how large it must be to show
  trueline calibrate --log=flight2 --out=result2 --model=result/model.yaml
      the next flight with what was found
  trueline diagnose --drive=rotors --log=flight --out=result --config=config/calibrate/rotors.yaml
      what the model driven by rotor speeds gets wrong: drag, a weak rotor, a load that slips, ...;
      further flights after commas confirm here, too

  trueline diagnose --log=flight --against=yesterday/,flight3,flight4 --out=result
      what differs from reference flights of the vehicle: by the commands that hold it in the air (a
      weak rotor or a load under it, two rotors, the thrust of all; needs positions and motor
      commands, no IMU), and, where the logs hold what --drive needs, every effect of the catalogue
      that they lack or have in another size; foreign logs are converted on the way

Exit codes: 0 done, 2 bad input or usage, 3 the flight can't be diagnosed, 4 refused by --fail_on,
1 a defect.)";

trueline::FailOn Refused() {
  return trueline::FailOn(FLAGS_fail_on, {"explained", "ambiguous", "unexplained"});
}

// The flight and further ones, looked at; without further ones that have a fatal fault.
std::vector<trueline::FlightLog> ReadLogs(const std::vector<std::string>& paths,
                                          trueline::ForDrive drive,
                                          std::vector<trueline::LogFault>* faults) {
  std::vector<trueline::FlightLog> logs = trueline::ReadFlights(paths, faults, drive, FLAGS_map);
  trueline::LeaveOutFaultyFlights(&logs, faults);
  return logs;
}

std::string TableOf(const trueline::Diagnosis& diagnosis) {
  const std::string tried = FLAGS_verbose ? trueline::CandidateTable(diagnosis) : "";
  return tried + trueline::DiagnosisTable(diagnosis);
}

// A diagnosis, and the options that it ran with, for its provenance.
struct Diagnosed {
  trueline::Diagnosis diagnosis;
  YAML::Node options;
};

// `against`: the logs after the first are references.
Diagnosed DiagnoseByRotors(const std::vector<trueline::FlightLog>& logs, bool against) {
  trueline::RotorDiagnosisOptions options(
      trueline::ResolveRotorOptions(FLAGS_config, FLAGS_model, logs));
  options.alpha = FLAGS_alpha;
  options.against = against;
  Diagnosed out{trueline::Diagnose(logs, options), trueline::ToYaml(options.calibration)};
  if (FLAGS_fit_to != "fixes") {
    out.diagnosis.warnings.emplace_back(
        "--fit_to is not used with --drive=rotors; fit_to in the --config names the poses");
  }
  return out;
}

Diagnosed DiagnoseByImu(const std::vector<trueline::FlightLog>& logs, bool against) {
  trueline::CalibrationOptions calibration =
      trueline::ResolveCalibrationOptions({FLAGS_config, FLAGS_model, "vgd", "", "", 0});
  trueline::LimitModelTo(logs, FLAGS_model, &calibration);
  trueline::ImuDiagnosisOptions options = trueline::DiagnosisOptionsOf(calibration);
  options.fit_to_mocap = FLAGS_fit_to == "mocap";
  options.alpha = FLAGS_alpha;
  options.against = against;
  return {trueline::Diagnose(logs, options), trueline::ToYaml(options.vgd)};
}

bool ByRotors() { return FLAGS_drive == "rotors"; }

Diagnosed DiagnoseLogs(const std::vector<trueline::FlightLog>& logs, bool against) {
  Diagnosed done = ByRotors() ? DiagnoseByRotors(logs, against) : DiagnoseByImu(logs, against);
  done.diagnosis.log = trueline::SplitPaths(FLAGS_log).front();
  done.diagnosis.folder = FLAGS_out;
  if (ByRotors()) done.diagnosis.flags = " --drive=rotors";
  if (!FLAGS_config.empty()) done.diagnosis.flags += " --config=" + FLAGS_config;
  return done;
}

int RunAlone() {
  trueline::ResultFolder out(FLAGS_out, "trueline-diagnose");  // fails before the work
  std::vector<trueline::LogFault> faults;
  const std::vector<trueline::FlightLog> logs =
      ReadLogs(trueline::SplitPaths(FLAGS_log),
               ByRotors() ? trueline::ForDrive::kRotors : trueline::ForDrive::kImu, &faults);
  Diagnosed done = DiagnoseLogs(logs, false);
  trueline::Diagnosis& diagnosis = done.diagnosis;
  trueline::AddLogFaults(faults, &diagnosis);
  trueline::WarnAll(diagnosis.warnings, FLAGS_quiet);
  const YAML::Node provenance = trueline::Provenance(logs.front(), 0, done.options);
  trueline::WriteDiagnosis(diagnosis, trueline::DiagnosisNode(diagnosis, provenance), out.path());
  trueline::Publish("diagnosis", FLAGS_report, FLAGS_quiet, TableOf(diagnosis), &out);
  if (!FLAGS_quiet) {
    fmt::print(stderr, "done in {:.1f} s, of which the base fit took {:.1f} s\n", diagnosis.seconds,
               diagnosis.base_seconds);
  }
  return Refused().ExitFor(diagnosis.verdict);
}

// True if the log may hold what the drive is fitted to; the trim needs less.
bool HoldsDrive(const trueline::FlightLog& log) {
  const bool placed = !log.fixes.empty() || !log.mocap.empty();
  return !log.imu.empty() && placed && (!ByRotors() || !log.rotors.empty());
}

bool HasCommands(const trueline::FlightLog& log) {
  return !log.motors.empty() || !log.rotors.empty();
}

// A flight and its references, with their sessions by directory and the faults of the flight.
struct AgainstLogs {
  std::vector<trueline::FlightLog> logs;
  std::map<std::string, int> sessions;
  std::vector<trueline::LogFault> faults;
};

AgainstLogs ReadAgainst() {
  const std::vector<trueline::NamedFlight> named = trueline::FlightsOf(FLAGS_log);
  if (named.size() != 1) throw trueline::InputError("--against: give one flight in --log");
  AgainstLogs read;
  std::vector<std::string> paths = {named.front().path};
  for (const auto& [path, session] : trueline::ReferencesOf(named.front(), FLAGS_against)) {
    paths.push_back(path);
    read.sessions[path] = session;
  }
  read.logs = ReadLogs(paths, trueline::ForDrive::kCommands, &read.faults);
  if (read.logs.size() > 1) return read;
  trueline::WarnAll(read.logs.front().warnings, FLAGS_quiet);
  throw trueline::NoUsableResult("--against: every reference has a fatal fault; give others");
}

std::vector<const trueline::FlightLog*> Others(const std::vector<trueline::FlightLog>& logs) {
  std::vector<const trueline::FlightLog*> others;
  for (const trueline::FlightLog& log : std::span(logs).subspan(1)) others.push_back(&log);
  return others;
}

trueline::UsualScatter Usual() {
  trueline::UsualScatter usual;
  auto& [within, between] = usual;
  char more = '\0';
  const int found = std::sscanf(FLAGS_usual_scatter.c_str(), "%lf,%lf,%lf,%lf%c", &within.common,
                                &within.own, &between.common, &between.own, &more);
  const bool positive =
      within.common >= 0.0 && within.own > 0.0 && between.common >= 0.0 && between.own > 0.0;
  if (found == 4 && positive) return usual;
  throw trueline::InputError("--usual_scatter=" + FLAGS_usual_scatter +
                             ": write four positive numbers with commas between; see --help");
}

// By the commands that hold the vehicle in the air. Throws NoUsableResult where no reference can be
// used.
trueline::Comparison CompareTrims(const AgainstLogs& read) {
  const trueline::CommandTrim trim = trueline::TrimOf(read.logs.front());
  std::vector<trueline::ReferenceFlight> references;
  std::vector<std::string> warnings;
  for (const trueline::FlightLog& log : std::span(read.logs).subspan(1)) {
    try {
      references.push_back({trueline::TrimOf(log), read.sessions.at(log.directory)});
    } catch (const trueline::NoUsableResult& error) {
      warnings.push_back(std::string("left out of the trims: ") + error.what());
    }
  }
  if (references.empty()) {
    trueline::WarnAll(warnings, FLAGS_quiet);
    throw trueline::NoUsableResult("--against: no flight can be used");
  }
  trueline::Comparison comparison =
      trueline::Compare(trim, references,
                        FLAGS_session == "same" ? trueline::SessionOfFlight::kSame
                                                : trueline::SessionOfFlight::kUnknown,
                        {Usual(), FLAGS_alpha});
  comparison.response = trueline::ResponseOf(read.logs.front(), Others(read.logs));
  comparison.warnings.insert(comparison.warnings.end(), warnings.begin(), warnings.end());
  return comparison;
}

// The causes of the flight that its references lack; none where a log holds too little for it.
std::optional<Diagnosed> DiagnoseChanges(const AgainstLogs& read) {
  std::vector<trueline::FlightLog> logs;
  std::ranges::copy_if(read.logs, std::back_inserter(logs), HoldsDrive);
  if (!HoldsDrive(read.logs.front()) || logs.size() == 1) return std::nullopt;
  try {
    Diagnosed done = DiagnoseLogs(logs, true);
    for (const trueline::FlightLog& log : std::span(logs).subspan(1)) {
      done.diagnosis.against.push_back(log.directory);
    }
    trueline::AddLogFaults(read.faults, &done.diagnosis);
    return done;
  } catch (const trueline::InputError& error) {
    trueline::Warn(std::string("compared by the commands alone: ") + error.what(), FLAGS_quiet);
    return std::nullopt;
  }
}

// A trim reads no IMU, takes from positions only when the vehicle flies, and its means do without
// some of the samples.
bool BendsTrim(const trueline::LogFault& fault) {
  const std::set<std::string> values = {"motors", "rotors", "battery", "attitude"};
  return fault.fatal || (values.contains(fault.stream) && fault.kind != &trueline::fault::kGaps);
}

// The trims alone, of logs that hold no more.
int StoreTrims(const AgainstLogs& read, trueline::ResultFolder* out) {
  const trueline::FlightLog& log = read.logs.front();
  trueline::Comparison comparison = CompareTrims(read);
  std::vector<trueline::LogFault> faults;
  std::ranges::copy_if(read.faults, std::back_inserter(faults), BendsTrim);
  comparison.verdict = trueline::VerdictWith(faults, comparison.verdict);
  for (const trueline::LogFault& fault : faults) comparison.log_faults.push_back(fault.text);
  comparison.warnings.insert(comparison.warnings.begin(), log.warnings.begin(), log.warnings.end());
  trueline::WarnAll(comparison.warnings, FLAGS_quiet);
  trueline::WriteComparison(comparison, trueline::Provenance(log, 0, YAML::Node()), out->path());
  trueline::Publish("diagnosis", FLAGS_report, FLAGS_quiet, trueline::ComparisonTable(comparison),
                    out);
  return Refused().ExitFor(comparison.verdict);
}

int StoreChanges(const AgainstLogs& read, const Diagnosed& changes, trueline::ResultFolder* out) {
  const trueline::Diagnosis& diagnosis = changes.diagnosis;
  trueline::WarnAll(diagnosis.warnings, FLAGS_quiet);
  YAML::Node result = trueline::DiagnosisNode(
      diagnosis, trueline::Provenance(read.logs.front(), 0, changes.options));
  std::string table = TableOf(diagnosis);
  if (std::ranges::all_of(read.logs, HasCommands)) {
    try {
      const trueline::Comparison comparison = CompareTrims(read);
      trueline::WarnAll(comparison.warnings, FLAGS_quiet);
      trueline::AddComparison(comparison, &result);
      trueline::WriteTrims(comparison, out->path() / "trims.csv");
      table += "\nby the trim, " + trueline::ComparisonTable(comparison);
    } catch (const trueline::NoUsableResult& error) {
      trueline::Warn(std::string("the trim is not compared: ") + error.what(), FLAGS_quiet);
    }
  }
  trueline::WriteDiagnosis(diagnosis, result, out->path());
  trueline::Publish("diagnosis", FLAGS_report, FLAGS_quiet, table, out);
  return Refused().ExitFor(result["verdict"].as<std::string>());
}

int RunAgainst() {
  if (FLAGS_session != "unknown" && FLAGS_session != "same") {
    throw trueline::InputError("--session=" + FLAGS_session + " is not known; use unknown or same");
  }
  trueline::ResultFolder out(FLAGS_out, "trueline-diagnose");
  const AgainstLogs read = ReadAgainst();
  const std::optional<Diagnosed> changes = DiagnoseChanges(read);
  return changes ? StoreChanges(read, *changes, &out) : StoreTrims(read, &out);
}

int Run() {
  if (FLAGS_drive != "imu" && FLAGS_drive != "rotors") {
    throw trueline::InputError("--drive: '" + FLAGS_drive + "' is unknown; use imu or rotors");
  }
  if (trueline::SplitPaths(FLAGS_log).empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--log and --out are needed; see trueline diagnose --help");
  }
  if (FLAGS_fit_to != "fixes" && FLAGS_fit_to != "mocap") {
    throw trueline::InputError("--fit_to=" + FLAGS_fit_to + " is not known; use fixes or mocap");
  }
  if (!(FLAGS_alpha > 0.0 && FLAGS_alpha < 1.0)) {
    throw trueline::InputError("--alpha must lie between 0 and 1");
  }
  Refused();  // a word that is not known fails before the work
  if (!FLAGS_against.empty()) return RunAgainst();
  return RunAlone();
}

}  // namespace

TRUELINE_VERB("diagnose", kUsage, Run);
