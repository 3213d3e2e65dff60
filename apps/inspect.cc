// trueline-inspect: what is wrong with a log, before anything is fitted.
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/result_folder.h"
#include "problems/import/convert.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/open_recording.h"
#include "problems/inspection/corrected_map.h"
#include "problems/inspection/inspection.h"
#include "problems/inspection/settle_proposal.h"
#include "problems/log/log_yaml.h"
#include "problems/log/native_log.h"
#include "problems/result/render.h"
#include "problems/result/yaml_text.h"
#include "problems/rotor/rotor_vehicle.h"

DEFINE_string(log, "",
              "a native log's folder, or the foreign log, or its files with commas between");
DEFINE_string(
    map, "",
    "the column map of a foreign log; without it, one of config/import that fits, else one "
    "by the names of its columns");
DEFINE_string(vehicle, "", "YAML with vehicle: {rotors: [...]}, for a log that states no rotors");
DEFINE_string(out, "", "where results go; made if missing");
DEFINE_string(fail_on, "",
              "end with exit code 4 where a finding is: warning (widens or worse) or fatal");
DEFINE_bool(report, true, "write report.html");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Finds what is wrong with a log: rates, clocks, axes, scales, rotors.

  trueline inspect --log=logs/flight --out=out/inspection
      lists the faults of a native log, worst first, and writes out/inspection/inspection.yaml
      and report.html; corrected_map.yaml beside them repairs what can be repaired
  trueline inspect --log=flight.ulg --out=out/inspection
      the same for any log that trueline convert reads
  trueline inspect --map=config/import/nanobench.yaml --log=B7_oval_fast_rep1.csv --out=out/oval
  trueline convert --map=out/oval/corrected_map.yaml --in=B7_oval_fast_rep1.csv --out=logs/oval
      the log as repaired; the output of trueline inspect ends with this command
  trueline inspect --log=logs/flight --vehicle=config/calibrate/rotors_neurobem.yaml --out=out/rotors
      compares order and spin of the rotors with those that a file states

Nothing is corrected silently: the log stays as it is. Levels: fatal (no right calibration is
possible), biases, widens, note. Exit codes: 0 done, 2 bad input or usage, 3 no IMU to inspect,
4 refused by --fail_on.)";

using namespace trueline;  // NOLINT(google-build-using-namespace): a main file

constexpr char kCorrectedMap[] = "corrected_map.yaml";

FailOn Refused() { return FailOn(FLAGS_fail_on, {"warning", "fatal"}); }

// The worst finding, as --fail_on says it; empty where there are notes alone.
std::string WorstOf(const Inspection& inspection) {
  if (inspection.findings.empty() || inspection.findings.front().level == Level::kNote) return "";
  return inspection.findings.front().level == Level::kFatal ? "fatal" : "warning";
}

// The log as recorded, with the map that it came by.
struct Opened {
  FlightLog log;
  YAML::Node map;
  FileAttitudes sources;
  std::vector<std::string> files;  // of the map's inputs
};

// Take-off and landing are inspected too; parts that the map cuts by time are not.
Opened OpenForeign() {
  Opened opened;
  opened.files = SplitPaths(FLAGS_log);
  ImportMap map;
  std::vector<std::string> assumed;
  std::optional<FlightLog> read;
  if (FLAGS_map.empty()) {
    FoundLog found = FindLog(opened.files);
    read = SettleProposal(&found);
    map = MapOf(found);
    opened.files = found.files;
    opened.map = YAML::Load(found.map);
    assumed = AssumptionWarnings(found);
  } else {
    map = ReadUserMap(FLAGS_map, opened.files, &assumed, &opened.map);
  }
  const bool whole = !map.cut.min_height && !map.fixes_from_mocap;
  map.cut.min_height.reset();
  map.fixes_from_mocap.reset();
  opened.sources = FileAttitudesOf(map);
  opened.log = read && whole ? *std::move(read) : ConvertLog(map, opened.files, {});
  opened.log.warnings.insert(opened.log.warnings.end(), assumed.begin(), assumed.end());
  return opened;
}

Opened Open() {
  const std::filesystem::path folder = FLAGS_log;
  if (!HoldsNativeStreams(folder)) return OpenForeign();
  if (!std::filesystem::exists(folder / "imu.csv")) {
    throw InputError((folder / "imu.csv").string() +
                     ": is missing; a native log (a folder with log.yaml) needs it");
  }
  if (!FLAGS_map.empty())
    throw InputError("--map is for foreign logs; " + FLAGS_log + " is native");
  Opened opened;
  opened.log = ReadNativeLog(FLAGS_log);
  NativeMap native = MapOfNativeLog(opened.log);
  opened.map = native.map;
  opened.files = native.files;
  return opened;
}

// The rotors that --vehicle states; other keys of its vehicle are for a calibration.
void TakeVehicle(FlightLog* log) {
  if (FLAGS_vehicle.empty()) return;
  const YamlMap map = YamlMap::FromFile(FLAGS_vehicle);
  Vehicle vehicle;
  vehicle.rotors = ReadRotors(map.Child("vehicle").Children("rotors"));
  if (vehicle.rotors.empty()) map.Fail("vehicle", "states no rotors");
  log->vehicle = vehicle;
}

// The word as a shell reads it back, in quotes where it holds a blank or the like.
std::string ShellWord(const std::string& word) {
  const auto plain = [](unsigned char c) {
    return std::isalnum(c) ||
           std::string("-_./=,:+%@").find(static_cast<char>(c)) != std::string::npos;
  };
  if (std::all_of(word.begin(), word.end(), plain)) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// Writes the corrected map where there is something to repair; the command that uses it.
std::string WriteCorrected(const Opened& opened, const Repairs& repairs, const ResultFolder& out) {
  if (repairs.IsNone()) return "";
  const std::string head =
      "# Made by trueline-inspect: the map with the repairs that inspection.yaml lists.\n";
  WriteFileAtomically(out.path() / kCorrectedMap, head + TextOf(CorrectMap(opened.map, repairs)));
  const std::string map = (std::filesystem::path(FLAGS_out) / kCorrectedMap).string();
  return fmt::format("trueline convert {} {} --out=REPAIRED", ShellWord("--map=" + map),
                     ShellWord(fmt::format("--in={}", fmt::join(opened.files, ","))));
}

int InspectLog(ResultFolder* out) {
  Opened opened = Open();
  TakeVehicle(&opened.log);
  WarnAll(opened.log.warnings, FLAGS_quiet);
  const Inspection inspection = Inspect(opened.log, opened.sources);
  const std::string command = WriteCorrected(opened, inspection.repairs, *out);
  WriteFileAtomically(out->path() / "inspection.yaml",
                      InspectionYaml(inspection, FLAGS_log, command));
  std::string table = InspectionTable(inspection);
  if (!command.empty()) table += fmt::format("\nTo repair:\n  {}\n", command);
  const NativeFolder drawn(opened.log, FLAGS_report);
  Publish("inspection", FLAGS_report, FLAGS_quiet, table, out, {"--log=" + drawn.path()});
  return Refused().ExitFor(WorstOf(inspection));
}

void CheckMapIsNoResult() {
  if (FLAGS_map.empty()) return;
  std::error_code unknown;
  const auto written =
      std::filesystem::weakly_canonical(std::filesystem::path(FLAGS_out) / kCorrectedMap, unknown);
  if (std::filesystem::weakly_canonical(FLAGS_map, unknown) != written) return;
  throw InputError(FLAGS_map + " lies in --out and would be replaced; give another --out");
}

int Run() {
  if (FLAGS_log.empty() || FLAGS_out.empty()) {
    throw InputError("--log and --out are needed; see trueline inspect --help");
  }
  Refused();  // a word that is not known fails before the work
  CheckMapIsNoResult();
  ResultFolder out(FLAGS_out, "trueline-inspect");
  return InspectLog(&out);
}

}  // namespace

TRUELINE_VERB("inspect", kUsage, Run);
