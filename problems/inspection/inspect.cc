#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/log/imu_health.h"

namespace trueline {
namespace {

constexpr double kMetresOfFoot = 0.3048;

constexpr auto kReadAsSi = std::to_array<KnownUnit>({
    {"m/s^2", "g", 9.80665},
    {"m/s^2", "thousandths of g", 9.80665e-3},
    {"m/s^2", "cm/s^2", 1e-2},
    {"m/s^2", "mm/s^2", 1e-3},
    {"m/s^2", "ft/s^2", kMetresOfFoot},
    {"m/s^2", "m/s^2 converted as if from g", 1.0 / 9.80665},
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
    {"m", "ft", kMetresOfFoot},
    {"m", "m converted as if from ft", 1.0 / kMetresOfFoot},
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
  all->earth = change.earth * all->earth;
  all->body = change.body * all->body;
  all->accel = change.accel * all->accel;
  all->gyro = change.gyro * all->gyro;
  all->position = change.position * all->position;
  all->accel_scale *= change.accel_scale;
  all->gyro_scale *= change.gyro_scale;
  all->position_scale *= change.position_scale;
  all->channel_scale *= change.channel_scale;
  if (!change.order.empty()) all->order = change.order;
  all->leave_out.insert(all->leave_out.end(), change.leave_out.begin(), change.leave_out.end());
  all->only_new = all->only_new || change.only_new;
}

}  // namespace

const char* NameOf(Level level) {
  constexpr std::array<const char*, 4> kNames = {"fatal", "biases", "widens", "note"};
  return kNames[static_cast<std::size_t>(level)];
}

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

void Examination::AddRepaired(Finding finding, const StreamRepair& change) {
  finding.repaired = true;
  Repair(finding.stream, change);
  Add(std::move(finding));
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

Level LevelOfTurn(double size) { return size > 15.0 ? Level::kFatal : Level::kBiases; }

double LeanOf(const Eigen::Vector3d& force) {
  return std::acos(std::clamp(-force.z() / force.norm(), -1.0, 1.0));
}

std::string DriftRemedy(const FlightLog& log, double drift) {
  const double scale = 1.0 / (1.0 + drift);
  return fmt::format("multiply its stamps by {:.7f} and add {:.3f} s (time: column, scale, offset)",
                     scale, ToSeconds(log.imu.front().t) * (1.0 - scale));
}

std::string LateText(double seconds) {
  return fmt::format("{:.3f} s {}", std::abs(seconds), seconds > 0.0 ? "later" : "earlier");
}

Inspection Inspect(const FlightLog& log, const FileAttitudes& sources) {
  Examination e{log, sources, log, {}, {}};
  FindCopies(&e);
  const std::optional<TimeNs> jump = CheckImuJump(&e);
  e.result.streams = CheckStreams(log, jump, &e.result.findings);
  CheckCover(&e);
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

}  // namespace trueline
