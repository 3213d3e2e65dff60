// trueline-convert: a foreign log to a native log, by a YAML column map.
#include "problems/import/convert.h"

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/atomic_file.h"
#include "problems/common/error.h"
#include "problems/common/result_folder.h"
#include "problems/import/channel_row.h"
#include "problems/import/find_map.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/import_map.h"
#include "problems/inspection/first_look.h"
#include "problems/inspection/settle_proposal.h"
#include "problems/log/native_log.h"

DEFINE_string(in, "", "the log, or several with commas between, in the map's order");
DEFINE_string(map, "", "YAML column map; config/import has one for each known source");
DEFINE_string(out, "", "directory of the native log, made if missing");
DEFINE_uint64(seed, 0, "of the fixes that are sampled from mocap");
DEFINE_double(fix_sigma, 0.0, "m; sigma of detected fixes, in place of the map's (0: the map's)");
DEFINE_string(straights, "", "conditions such as '-0.9<x<0.9;-2<y<2' (m, in E), or 'auto'");
DEFINE_int32(min_count, -1, "least number of sampled fixes on a straight (-1: the map's)");
DEFINE_int32(max_count, -1, "greatest number of them (-1: the map's)");
DEFINE_double(sigma_factor, -1.0, "their sigma over the distance to the gate (-1: the map's)");
DEFINE_double(sigma_floor, -1.0, "m; their least sigma (-1: the map's)");
DEFINE_double(student_dof, -1.0, "degrees of freedom of heavy tails, 0: Gaussian (-1: the map's)");
DEFINE_double(outlier_share, -1.0, "share of outliers among them, 0 to 1 (-1: the map's)");
DEFINE_double(outlier_size, -1.0, "m; standard deviation of an outlier (-1: the map's)");
DEFINE_bool(quiet, false, "no table and no warnings");

namespace {

constexpr char kUsage[] =
    R"(Turns a foreign log into a native log: a directory with log.yaml and one CSV a stream.

  trueline convert --in=flight.ulg                 # lists what is in a log, and proposes a map
  trueline convert --in=flight.ulg --out=out/flight
  trueline convert --map=config/import/nanobench.yaml --in=B7_oval_fast_rep1.csv --out=out/oval

The format is known by the content: CSV, PX4 ULog, ROS 1 and 2 bags, MCAP, ArduPilot DataFlash,
Betaflight blackbox, Crazyflie micro-SD, ASL (EuRoC) folder, TUM trajectory. Without --map, a map of
config/import that fits is used. Exit code 3: no usable log can be made, for the reason printed.

A new source needs a map of its own and no code; config/reference/map.md lists the keys, and
config/import/nanobench.yaml explains them. Several files go in the map's order:

  trueline convert --map=config/import/li_bebop_drag.yaml --in=5deg.csv,take_5deg.csv --out=out/drag

A log without a gate detector gets fixes sampled from mocap (Li et al. 2019, eq. 33) where its map
says so; these flags change how, with the same --seed giving the same fixes:

  trueline convert --map=config/import/nanobench.yaml --in=B7_oval_fast_rep1.csv --out=out/oval \
      --straights='-0.9<x<0.9' --sigma_factor=0.1 --outlier_share=0.05 --seed=3)";

using namespace trueline;  // NOLINT(google-build-using-namespace): a main file

constexpr char kProposed[] = "proposed_map.yaml";

// `found`: by what map the log is read where the user gives none, else null. `read`: the log as
// that map reads it without options.
int Convert(const ImportMap& map, const FoundLog* found, std::optional<FlightLog> read) {
  std::vector<std::string> outputs = NativeLogFiles();
  if (found != nullptr) outputs.emplace_back(kProposed);  // else it may be the user's edited one
  for (const std::string& input : SplitPaths(FLAGS_in)) {
    std::error_code unknown;
    const auto folder = std::filesystem::weakly_canonical(FLAGS_out, unknown);
    if (std::filesystem::weakly_canonical(input, unknown).parent_path() == folder) {
      throw InputError(input + " lies in --out and might be replaced; give another --out");
    }
  }
  ResultFolder out(FLAGS_out, outputs);
  ConvertOptions options;
  options.seed = FLAGS_seed;
  if (FLAGS_fix_sigma != 0.0) options.fix_sigma = FLAGS_fix_sigma;
  if (options.fix_sigma && !(*options.fix_sigma >= kLeastSigma)) {
    throw InputError(fmt::format("--fix_sigma must be positive, {} m or more", kLeastSigma));
  }
  options.fixes_from_mocap = OverrideFixes(map,
                                           {{"min_count", FLAGS_min_count},
                                            {"max_count", FLAGS_max_count},
                                            {"sigma_factor", FLAGS_sigma_factor},
                                            {"sigma_floor", FLAGS_sigma_floor},
                                            {"student_dof", FLAGS_student_dof},
                                            {"outlier_share", FLAGS_outlier_share},
                                            {"outlier_size", FLAGS_outlier_size}},
                                           FLAGS_straights);
  const bool as_read = read && !options.fixes_from_mocap && !options.fix_sigma;
  FlightLog converted = as_read            ? *std::move(read)
                        : found == nullptr ? ConvertLog(map, SplitPaths(FLAGS_in), options)
                                           : ConvertFound(*found, options);
  const std::string moved =
      map.mocap_on_imu_clock ? AlignMocap(map.fixes_from_mocap.has_value(), &converted) : "";
  if (!moved.empty()) Warn(moved, FLAGS_quiet);
  WarnAll(converted.warnings, FLAGS_quiet);
  if (found != nullptr) {
    for (const std::string& lack : Shortcomings(converted, FLAGS_in)) Warn(lack, FLAGS_quiet);
    WarnAll(AssumptionWarnings(*found), FLAGS_quiet);
    WriteFileAtomically(out.path() / kProposed, found->map);
  }
  WriteNativeLog(converted, out.path());
  const FlightLog log = converted.imu.empty() || !HasPositions(converted)
                            ? ReadCommandLog(out.path())
                            : ReadAndLook(out.path());
  WarnAll(log.warnings, FLAGS_quiet);
  out.Commit(FLAGS_quiet);
  if (!FLAGS_quiet) fmt::print("{}", StreamTable(log));
  return kExitDone;
}

// Writes the map to be edited; one that is there may be edited already and stays.
void Propose(const std::string& proposed) {
  const std::filesystem::path file = std::filesystem::path(FLAGS_out) / kProposed;
  if (!std::filesystem::exists(file)) return WriteFileAtomically(file, proposed);
  if (FirstBytes(file, 1 << 20) == proposed) return;
  Warn(file.string() + " differs from the map proposed now and is kept; remove it for a new one",
       FLAGS_quiet);
}

// Lists the log and the map that reads it; converts by that if --out is given. Where no usable log
// can be made, an earlier one stays; the map to be edited comes beside it.
int WithoutMap() {
  FoundLog found = FindLog(SplitPaths(FLAGS_in));
  // To list a recording that a map reads it need not be read whole.
  const bool settle = !FLAGS_out.empty() || !found.shipped || AreTables(found);
  std::optional<FlightLog> read = settle ? SettleProposal(&found) : std::nullopt;
  if (FLAGS_out.empty()) {
    WarnAll(found.recording->warnings(), FLAGS_quiet);
    if (!FLAGS_quiet) fmt::print("{}\n{}", ListChannels(*found.recording), found.map);
    return kExitDone;
  }
  try {
    return Convert(MapOf(found), &found, std::move(read));
  } catch (const NoUsableLog& error) {
    if (!found.shipped && !FLAGS_quiet) {
      WarnAll(found.recording->warnings(), FLAGS_quiet);
      fmt::print("{}\n{}", ListChannels(*found.recording), found.map);
    }
    Propose(found.map);
    if (found.shipped) throw;
    throw NoUsableLog(fmt::format(
        "{}. If it can be read otherwise, edit {}/proposed_map.yaml and give that by --map",
        error.what(), FLAGS_out));
  }
}

// A remedy where another map that ships fits the log.
std::string OtherMap() {
  if (SplitPaths(FLAGS_in).size() != 1) return "";
  const std::optional<ImportMap> shipped = FindShippedMap(*OpenRecording(FLAGS_in));
  // A map fits a log that lacks some of its streams.
  if (!shipped || std::filesystem::equivalent(shipped->file, FLAGS_map)) return "";
  return "; its columns are those of " + shipped->file;
}

int WithMap() {
  std::vector<std::string> warnings;
  YAML::Node node;
  const ImportMap map = ReadUserMap(FLAGS_map, SplitPaths(FLAGS_in), &warnings, &node);
  WarnAll(warnings, FLAGS_quiet);
  try {
    return Convert(map, nullptr, std::nullopt);
  } catch (const UnknownColumn& error) {
    throw InputError(error.what() + OtherMap());
  }
}

int Run() {
  if (FLAGS_in.empty() || (!FLAGS_map.empty() && FLAGS_out.empty())) {
    throw InputError("--map, --in and --out are needed, or --in alone; see --help for examples");
  }
  try {
    return FLAGS_map.empty() ? WithoutMap() : WithMap();
  } catch (const NoUsableLog& error) {
    throw NoUsableResult(std::string("no usable log: ") + error.what());
  }
}

}  // namespace

TRUELINE_VERB("convert", kUsage, Run);
