#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "problems/common/app.h"
#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/inspection.h"
#include "problems/log/imu_health.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

constexpr auto kReadAsSi = std::to_array<KnownUnit>({
    {"m/s^2", "g", kStandardGravity},
    {"m/s^2", "thousandths of g", 1e-3 * kStandardGravity},
    {"m/s^2", "cm/s^2", 1e-2},
    {"m/s^2", "mm/s^2", 1e-3},
    {"m/s^2", "ft/s^2", kFoot},
    {"m/s^2", "m/s^2 converted as if from g", 1.0 / kStandardGravity},
    {"rad/s", "deg/s", kDegree},
    {"rad/s", "thousandths of deg/s", 1e-3 * kDegree},
    {"rad/s", "rpm", kRpm},
    {"rad/s", "revolutions per second", 60.0 * kRpm},
    {"rad/s", "thousandths of rad/s", 1e-3},
    {"rad/s", "thousandths of rad/s converted as if from deg/s", 1e-3 / kDegree},
    {"rad/s", "rad/s converted as if from deg/s", 1.0 / kDegree},
    {"m", "cm", 1e-2},
    {"m", "mm", 1e-3},
    {"m", "km, or m converted as if from mm", 1e3},
    {"m", "ft", kFoot},
    {"m", "m converted as if from ft", 1.0 / kFoot},
});

std::string SignedAxis(const Eigen::RowVector3d& row) {
  Eigen::Index axis = 0;
  row.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", row[axis] < 0.0 ? "-" : "", "xyz"[axis]);
}

// Rotations add up from the left; scales multiply; of orders and forms there is one.
void Combine(const StreamRepair& change, StreamRepair* all) {
  all->time_offset += change.time_offset;
  if (change.quaternion != std::array<int, 4>{0, 1, 2, 3}) all->quaternion = change.quaternion;
  all->inverse = all->inverse != change.inverse;
  if (!change.angle_order.empty()) {
    all->angle_order = change.angle_order;
    all->angle_factor = change.angle_factor;
  }
  if (!change.force_by.empty()) {
    all->force_by = change.force_by;
    all->force_in_earth = change.force_in_earth;
    all->gravity_removed = change.gravity_removed;
  }
  for (const auto turn : kTurnsOfRepair) all->*turn = change.*turn * all->*turn;
  for (const auto scale : kScalesOfRepair) all->*scale *= change.*scale;
  if (!change.order.empty()) all->order = change.order;
  all->leave_out.insert(all->leave_out.end(), change.leave_out.begin(), change.leave_out.end());
  all->only_new = all->only_new || change.only_new;
}

YAML::Node FindingNode(const Finding& f) {
  YAML::Node node;
  node["id"] = f.kind->id;
  node["stream"] = f.stream;
  node["level"] = NameOf(f.level);
  node["size"] = Rounded(f.size, 5);
  if (std::isfinite(f.sigma)) node["sigma"] = Rounded(f.sigma, 3);
  node["unit"] = f.kind->unit;
  if (f.error > 0.0) {
    node["force_error"] = FlowMap({{"value", Rounded(f.error, 3)}, {"unit", "m/s^2"}});
  }
  node["text"] = f.text;
  node["remedy"] = f.remedy;
  node["repaired"] = f.repaired;
  return node;
}

YAML::Node AxisNode(const AxisHealth& axis) {
  const std::string unit = axis.axis[0] == 'a' ? "m/s^2" : "rad/s";
  return FlowMap({{"axis", axis.axis},
                  {"unit", unit},
                  {"quantum", Rounded(axis.quantum, 4)},
                  {"noise_density_per_sqrt_Hz", Rounded(axis.noise.density, 3)},
                  {"above_20_Hz_rms", Rounded(axis.noise.vibration, 3)},
                  {"line_Hz", Rounded(axis.noise.peak, 3)},
                  {"cutoff_Hz", Rounded(axis.noise.cutoff, 3)},
                  {"spikes", fmt::format("{}", axis.spikes)}});
}

YAML::Node StreamNode(const StreamHealth& h) {
  YAML::Node node = FlowMap({{"stream", h.stream},
                             {"samples", fmt::format("{}", h.count)},
                             {"rate_Hz", Rounded(h.rate, 5)},
                             {"jitter_s", Rounded(h.jitter, 3)},
                             {"gaps", fmt::format("{}", h.gaps)},
                             {"longest_gap_s", Rounded(h.longest, 4)},
                             {"repeats", Rounded(h.repeats, 3)},
                             {"spikes", fmt::format("{}", h.spikes)}});
  if (h.axes.empty()) return node;
  node.SetStyle(YAML::EmitterStyle::Block);
  for (const AxisHealth& axis : h.axes) node["axes"].push_back(AxisNode(axis));
  return node;
}

YAML::Node ComparisonNode(const MotionComparison& c) {
  YAML::Node node;
  node["stream"] = c.stream;
  node["what"] = c.what;
  node["shown"] = c.not_shown.empty();
  if (!c.not_shown.empty()) node["why_not"] = c.not_shown;
  if (!c.match) return node;
  const VectorMatch& m = *c.match;
  node["correlation"] = Rounded(m.correlation, 4);
  if (!c.not_shown.empty()) return node;
  node["late_by"] =
      FlowMap({{"value", Rounded(m.lag, 4)}, {"sigma", Rounded(m.lag_sigma, 2)}, {"unit", "s"}});
  if (std::isfinite(m.drift_sigma)) {
    node["drift"] = FlowMap(
        {{"value", Rounded(m.drift, 3)}, {"sigma", Rounded(m.drift_sigma, 2)}, {"unit", "s/s"}});
  }
  const Eigen::Vector3d turn = TurnBetween(m.turn, Eigen::Matrix3d::Identity()) / kDegree;
  YAML::Node angle;
  for (int i = 0; i < 3; ++i) {
    angle["value"].push_back(Rounded(turn[i], 4));
    angle["sigma"].push_back(Rounded(std::sqrt(m.turn_cov(i, i)) / kDegree, 2));
  }
  angle["unit"] = "deg";
  angle.SetStyle(YAML::EmitterStyle::Flow);
  node["turned_by"] = angle;
  node["mirrored"] = m.turn.determinant() < 0.0;
  node["handedness_sigmas"] = Rounded(std::abs(m.reflection), 3);
  node["size_ratio"] =
      FlowMap({{"value", Rounded(m.gain, 5)}, {"sigma", Rounded(m.gain_sigma, 2)}, {"unit", "1"}});
  return node;
}

YAML::Node RotorsNode(const RotorLayout& layout) {
  YAML::Node node;
  node["stream"] = layout.stream;
  node["answer_after"] = FlowMap({{"value", Rounded(layout.lag, 3)}, {"unit", "s"}});
  node["explained"] = FlowMap({{"roll", Rounded(layout.explained.x(), 3)},
                               {"pitch", Rounded(layout.explained.y(), 3)},
                               {"yaw", Rounded(layout.explained.z(), 3)}});
  for (std::size_t i = 0; i < layout.rotors.size(); ++i) {
    const auto word = [](int sign, const char* plus, const char* minus) {
      return std::string(sign > 0 ? plus : sign < 0 ? minus : "not shown");
    };
    node["channels"].push_back(FlowMap({{"front", word(layout.FrontOf(i), "front", "rear")},
                                        {"side", word(layout.RightOf(i), "right", "left")},
                                        {"spin", word(layout.SpinOf(i), "1", "-1")}}));
  }
  return node;
}

}  // namespace

bool Examination::IsCopy(const std::string& stream) const {
  return std::find(copies.begin(), copies.end(), stream) != copies.end();
}

bool Examination::Drifts(const std::string& stream) const {
  return std::find(drifting.begin(), drifting.end(), stream) != drifting.end();
}

StreamRepair Examination::RepairOf(const std::string& stream) const {
  const auto found = result.repairs.streams.find(stream);
  return found == result.repairs.streams.end() ? StreamRepair() : found->second;
}

void Examination::Repair(const std::string& stream, const StreamRepair& change) {
  Combine(change, &result.repairs.streams[stream]);
  ApplyRepair(stream, change, sources, &fixed);
}

void Examination::Add(Finding finding, const std::string& text, const std::string& remedy) {
  finding.text = text;
  finding.remedy = remedy;
  Add(std::move(finding));
}

void Examination::AddRepaired(Finding finding, const StreamRepair& change) {
  finding.repaired = true;
  Repair(finding.stream, change);
  Add(std::move(finding));
}

void Examination::AddRepaired(Finding finding, const std::string& text, const std::string& remedy,
                              const StreamRepair& change) {
  finding.text = text;
  finding.remedy = remedy;
  AddRepaired(std::move(finding), change);
}

const KnownUnit* UnitNear(const std::string& si, double factor, double error) {
  const KnownUnit* nearest = nullptr;
  double least = kOtherScale + error;
  for (const KnownUnit& unit : kReadAsSi) {
    const double off = std::abs(std::log(factor / unit.factor));
    if (si != unit.si || !(off < least)) continue;
    nearest = &unit;
    least = off;
  }
  return nearest;
}

std::string UnitText(const KnownUnit* unit) {
  return unit == nullptr
             ? ""
             : fmt::format(": the factor of {} ({:.6g}) but for a usual bias, which is used",
                           unit->name, unit->factor);
}

void AddScale(Examination* e, double StreamRepair::*scale, double factor, const KnownUnit* unit,
              Finding finding, const std::string& text) {
  StreamRepair change;
  change.*scale = unit != nullptr ? unit->factor : factor;
  if (unit != nullptr) finding.level = Level::kFatal;
  e->AddRepaired(std::move(finding), text,
                 fmt::format("multiply its numbers by {:.6g}{}; check the unit and the range",
                             change.*scale, UnitText(unit)),
                 change);
}

std::vector<AttitudeSample> AttitudesOf(const FlightLog& log, const std::string& stream) {
  if (stream == "mocap") return AttitudesOf(log.mocap);
  if (stream == "pose") return AttitudesOf(log.pose);
  return log.attitude;
}

bool IsSignedPermutation(const Eigen::Matrix3d& m) {
  return (m.cwiseAbs() - m.cwiseAbs().array().round().matrix()).norm() < 1e-9;
}

std::string AxesText(const Eigen::Matrix3d& turn) {
  if (IsSignedPermutation(turn)) {
    return fmt::format("({}, {}, {})", SignedAxis(turn.row(0)), SignedAxis(turn.row(1)),
                       SignedAxis(turn.row(2)));
  }
  const Eigen::Vector3d angle = TurnBetween(turn, Eigen::Matrix3d::Identity()) / kDegree;
  return fmt::format("{}turned by ({:.1f}, {:.1f}, {:.1f}) deg",
                     turn.determinant() < 0.0 ? "mirrored and " : "", angle.x(), angle.y(),
                     angle.z());
}

double TurnSize(const Eigen::Matrix3d& turn) {
  if (turn.determinant() < 0.0) return 180.0;
  return TurnBetween(turn, Eigen::Matrix3d::Identity()).norm() / kDegree;
}

Level LevelOfError(double error) { return error > kBodyBias ? Level::kBiases : Level::kWidens; }

Level LevelOfLag(const VectorMatch& match, double error) {
  if (match.unshifted < 0.6 * match.correlation) return Level::kFatal;
  return LevelOfError(error);
}

double ErrorOfTurn(const Examination& e, double angle) {
  return 2.0 * e.log.gravity * std::sin(0.5 * angle);
}

Level LevelOfTurn(double size) { return size > 15.0 ? Level::kFatal : Level::kBiases; }

double LeanOf(const Eigen::Vector3d& force) {
  return std::acos(std::clamp(-force.z() / force.norm(), -1.0, 1.0));
}

std::string DriftRemedy(const FlightLog& log, double drift) {
  const double scale = 1.0 / (1.0 + drift);
  return fmt::format("multiply its stamps by {:.7f} and add {:.3f} s (time: column, scale, offset)",
                     scale, ToSeconds(log.imu.front().t) * (1.0 - scale));
}

std::string OrElseText(const VectorMatch& match) {
  return match.or_else ? fmt::format(", or {}, as laps repeat", LateText(*match.or_else)) : "";
}

std::string LateText(double seconds) {
  return fmt::format("{:.3f} s {}", std::abs(seconds), seconds > 0.0 ? "later" : "earlier");
}

Inspection Inspect(const FlightLog& log, const FileAttitudes& sources, const FlightLog* whole) {
  Examination e{log, sources, log, {}, {}};
  FindCopies(&e);
  const std::optional<TimeNs> jump = CheckImuJump(&e);
  e.result.streams = CheckStreams(log, jump, &e.result.findings);
  CheckCover(whole != nullptr ? *whole : log, &e);
  CheckRows(&e);
  CheckFrozen(&e);
  const auto imu = std::find_if(e.result.streams.begin(), e.result.streams.end(),
                                [](const StreamHealth& h) { return h.stream == "imu"; });
  const bool few = imu == e.result.streams.end() || imu->count < 100 || imu->rate < kLeastImuRate;
  if (few || imu->rate > kFastestImuRate) {
    e.result.notes.push_back(
        fmt::format("the IMU has {} samples at {:.3g} Hz: too {} to compare "
                    "other streams with it",
                    imu == e.result.streams.end() ? 0 : imu->count,
                    imu == e.result.streams.end() ? 0.0 : imu->rate, few ? "few" : "fast"));
  } else {
    CheckTimeScale(&e);
    CheckRates(&e);
    CheckBodies(&e);
    CheckForce(&e);
    CheckVertical(&e);
    CheckAccelerometer(&e);
    CheckHeading(&e);
    CheckPositions(&e);
    CheckRotors(&e);
    CheckRest(&e);
    CheckGravity(&e);
  }
  std::stable_sort(e.result.findings.begin(), e.result.findings.end(),
                   [](const Finding& a, const Finding& b) {
                     return a.level != b.level ? a.level < b.level : a.error > b.error;
                   });
  return e.result;
}

std::string InspectionYaml(const Inspection& inspection, const std::string& log,
                           const std::string& corrected) {
  YAML::Node node;
  node["log"] = log;
  node["findings"] = YAML::Node(YAML::NodeType::Sequence);
  for (const Finding& finding : inspection.findings) {
    node["findings"].push_back(FindingNode(finding));
  }
  if (!corrected.empty()) node["corrected_by"] = corrected;
  node["not_checked"] = inspection.notes;
  for (const MotionComparison& comparison : inspection.comparisons) {
    node["comparisons"].push_back(ComparisonNode(comparison));
  }
  if (inspection.rotors) node["rotors"] = RotorsNode(*inspection.rotors);
  for (const StreamHealth& health : inspection.streams) {
    node["streams"].push_back(StreamNode(health));
  }
  node["provenance"]["version"] = Version();
  return TextOf(node);
}

std::string InspectionTable(const Inspection& inspection) {
  std::string text;
  if (inspection.findings.empty()) {
    text = inspection.notes.empty() ? "No fault was found.\n"
                                    : "No fault was found in what could be checked.\n";
  }
  for (const Finding& f : inspection.findings) {
    text += fmt::format("{:<7} {:<21} {}\n        {}\n", NameOf(f.level), f.kind->id, f.text,
                        f.remedy + (f.repaired ? " [in corrected_map.yaml]" : ""));
  }
  for (const std::string& note : inspection.notes) {
    text += fmt::format("not checked: {}\n", note);
  }
  return text;
}

}  // namespace trueline
