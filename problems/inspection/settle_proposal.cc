#include "problems/inspection/settle_proposal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "problems/common/error.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/corrected_map.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/excerpt.h"
#include "problems/inspection/motion.h"
#include "problems/inspection/position_witness.h"
#include "problems/log/imu_health.h"
#include "problems/log/native_log.h"
#include "problems/log/samples.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

// The factor if it is that of a unit, else 1.
double FactorOfUnit(const char* si, double factor) {
  const KnownUnit* unit = UnitNear(si, factor);
  return unit != nullptr && unit->factor == factor ? factor : 1.0;
}

Eigen::Matrix3d AxesOnly(const Eigen::Matrix3d& turn) {
  return IsSignedPermutation(turn) ? turn : Eigen::Matrix3d::Identity();
}

// The part of a repair that is about what a file's numbers mean. Stamps, rows and small turns are
// those of the flight.
StreamRepair OfMeaning(const StreamRepair& repair, bool units_alone) {
  StreamRepair part = units_alone ? StreamRepair() : repair;
  part.accel_scale = FactorOfUnit("m/s^2", repair.accel_scale);
  part.gyro_scale = FactorOfUnit("rad/s", repair.gyro_scale);
  part.position_scale = FactorOfUnit("m", repair.position_scale);
  for (const auto turn : kTurnsOfRepair) part.*turn = AxesOnly(part.*turn);
  part.channel_scale = 1.0;
  part.time_offset = 0.0;
  part.order.clear();
  part.leave_out.clear();
  part.only_new = false;
  return part;
}

Repairs OfMeaning(const Repairs& all, bool units_alone) {
  Repairs part;
  for (const auto& [stream, repair] : all.streams) {
    const StreamRepair meaning = OfMeaning(repair, units_alone);
    if (!meaning.IsNone()) part.streams[stream] = meaning;
  }
  return part;
}

std::size_t CountFaults(const Inspection& inspection) {
  return static_cast<std::size_t>(std::count_if(
      inspection.findings.begin(), inspection.findings.end(), std::mem_fn(&Finding::Biases)));
}

struct Reading {
  FlightLog log;
  Inspection inspection;
};

Reading Inspected(const ImportMap& map, FlightLog log) {
  const std::optional<FlightLog> middle = MiddleOfLong(log);
  Inspection inspection = Inspect(middle ? *middle : log, FileAttitudesOf(map));
  return {std::move(log), std::move(inspection)};
}

Reading ReadBy(const ImportMap& map, const std::vector<std::string>& files) {
  return Inspected(map, ConvertLog(map, files, {}));
}

// What the map reads, if an inspection of that has fewer faults.
std::optional<Reading> Better(const YAML::Node& map, const std::string& name, const FoundLog& found,
                              const Reading& than) {
  Reading reading = ReadBy(ReadImportMapText(TextOf(map), name), found.files);
  const bool is_better = CountFaults(reading.inspection) < CountFaults(than.inspection);
  return is_better ? std::optional(std::move(reading)) : std::nullopt;
}

// Findings that the corrected map has taken away, as lines for the user.
std::vector<std::string> TakenAway(const Inspection& before, const Inspection& after) {
  std::vector<std::string> lines;
  for (const Finding& finding : before.findings) {
    const bool stays = std::any_of(
        after.findings.begin(), after.findings.end(),
        [&](const Finding& f) { return f.kind == finding.kind && f.stream == finding.stream; });
    if (stays || !finding.repaired || !finding.Biases()) continue;
    lines.push_back(fmt::format(
        "the names suggested another meaning; as the log shows, {}. The map corrects that",
        finding.text));
  }
  return lines;
}

// A recording whose accelerometer has another axis up than the shipped map says: EuRoC's stands
// upright, other ASL folders hold a drone's. Its axes are by one of the field's conventions if the
// log so read has fewer faults.
FlightLog SettleAxes(FoundLog* found) {
  FlightLog log = ConvertLog(*found->shipped, found->files, {});
  if (log.imu.empty() || !HasOtherUp(log)) return log;
  Reading best = Inspected(*found->shipped, std::move(log));
  const YAML::Node shipped = YAML::Load(found->map);
  const std::string file = found->shipped->file, earth = shipped["earth"].Scalar();
  for (const auto& [up, body] : {std::pair{earth, "FLU"}, {earth, "FRD"}, {"NED", "FRD"}}) {
    YAML::Node map = YAML::Clone(shipped);
    map["earth"] = up;
    map["body"] = body;
    auto better = Better(map, file, *found, best);
    if (!better) continue;
    best = *std::move(better);
    found->shipped = ReadImportMapText(TextOf(map), file);
    found->map = TextOf(map);
    found->assumed = {fmt::format(
        "{}: the accelerometer shows other axes than {} states: earth {}, body {}. That x is "
        "forward is assumed",
        found->recording->file(), file, up, body)};
  }
  return std::move(best.log);
}

constexpr double kOrdinaryLag = 0.004;  // s

std::optional<VectorMatch> MocapAgainstForce(const FlightLog& log) {
  if (log.mocap.empty() || log.attitude.empty()) return std::nullopt;
  return MatchBends(log, log.attitude, BendsOfStream(log, "mocap"), {kNearLag, kFineStep});
}

// Mocap of positions alone has the logged attitude in place of one of its own.
void CopyAttitude(FlightLog* log) {
  AttitudeCursor cursor(log->attitude);
  for (PoseSample& pose : log->mocap)
    cursor.At(pose.t, std::numeric_limits<double>::infinity(), &pose.q_E);
}

// A shift suits one time of a flight only where the clock drifts.
std::string DriftText(const FlightLog& log, const VectorMatch& match) {
  if (std::abs(match.drift) < std::max(kPlaceClock.drift, kShown * match.drift_sigma)) return "";
  return fmt::format(
      "mocap: its clock drifts by {:+.2e} s/s +- {:.1e} s/s against the IMU's, which a constant "
      "shift does not correct: {}",
      match.drift, match.drift_sigma, DriftRemedy(log, match.drift));
}

std::string Joined(const std::string& a, const std::string& b) {
  return a.empty() || b.empty() ? a + b : a + ". " + b;
}

}  // namespace

std::optional<FlightLog> SettleProposal(FoundLog* found) {
  std::optional<FlightLog> log;
  try {
    if (found->shipped && !AreTables(*found)) return SettleAxes(found);
    Reading before = ReadBy(MapOf(*found), found->files);
    log = std::move(before.log);
    YAML::Node map = YAML::Load(found->map);
    Repairs repairs = OfMeaning(before.inspection.repairs, found->shipped.has_value());
    // Without gravity the mean force shows no axes, so that the proposal may have guessed wrong.
    if (repairs.streams["imu"].gravity_removed < 0.0) {
      const bool was_up = map["body"].as<std::string>() == "FLU";
      map["earth"] = was_up ? "NED" : "ENU";
      map["body"] = was_up ? "FRD" : "FLU";
      const ImportMap other = ReadImportMapText(TextOf(map), "proposed_map.yaml");
      repairs = OfMeaning(ReadBy(other, found->files).inspection.repairs, false);
    }
    if (repairs.IsNone()) return log;
    const YAML::Node corrected = CorrectMap(map, repairs);
    auto after = Better(corrected, "proposed_map.yaml", *found, before);
    if (!after) return log;
    log = std::move(after->log);
    found->shipped.reset();
    found->map = "# Proposed by the names of the columns, corrected by what the log shows.\n" +
                 TextOf(corrected);
    found->assumed = AssumptionsOf(corrected);
    for (const std::string& line : TakenAway(before.inspection, after->inspection)) {
      found->assumed.push_back(line);
    }
  } catch (const InputError&) {  // the conversion says why
  }
  return log;
}

FlightLog ReadAnyLog(const std::string& path, const std::string& map) {
  namespace fs = std::filesystem;
  std::error_code unknown;
  if (HoldsNativeStreams(path) || !fs::exists(path, unknown)) return ReadCommandLog(path);
  FoundLog found;
  std::optional<FlightLog> settled;
  if (map.empty()) {
    found = FindLog({path});
    settled = SettleProposal(&found);
  } else {
    found.files = {path};
    found.shipped = ReadImportMap(map);
  }
  FlightLog log = settled ? *std::move(settled) : ConvertFound(found, {});
  if (found.shipped && found.shipped->mocap_on_imu_clock) {
    log.warnings.push_back(path + ": mocap keeps its own clock here; trueline convert aligns it");
  }
  if (!HasCommandsAlone(log)) {
    for (const std::string& lack : Shortcomings(log, path)) log.warnings.push_back(lack);
  }
  for (const std::string& line : AssumptionWarnings(found)) log.warnings.push_back(line);
  if (found.shipped) {
    log.warnings.push_back(
        fmt::format("{}: converted on the way by {}", path, found.shipped->file));
  }
  for (const std::string& warning : ImuWarnings(log.imu)) log.warnings.push_back(warning);
  log.directory = path;
  log.sha256[fs::path(path).filename().string()] = log.source["sha256"];
  return log;
}

std::string AlignMocap(bool sampled_fixes, FlightLog* log) {
  const std::optional<VectorMatch> match = MocapAgainstForce(*log);
  if (!match || match->correlation < kAlike) return "";
  std::string drift = DriftText(*log, *match);
  if (match->or_else) return drift;
  if (std::abs(match->lag) < std::max(kOrdinaryLag, kShown * match->lag_sigma)) return drift;
  const TimeNs shift = FromSeconds(match->lag);
  const bool copy = RepeatsAttitude(*log, AttitudesOf(log->mocap));
  for (PoseSample& pose : log->mocap) pose.t -= shift;
  if (copy) CopyAttitude(log);
  if (sampled_fixes) {
    for (Fix& fix : log->fixes) fix.t -= shift;
  }
  const std::string moved = fmt::format(
      "mocap: its stamps are moved by {:+.3f} s +- {:.3f} s onto the IMU's clock, as `mocap_clock: "
      "imu` asks (correlation with the accelerometer {:.3f}, as stamped {:.3f})",
      -match->lag, match->lag_sigma, match->correlation, match->unshifted);
  return Joined(moved, drift);
}

}  // namespace trueline
