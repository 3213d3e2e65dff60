#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/excerpt.h"
#include "problems/inspection/following_filter.h"
#include "problems/inspection/heading.h"

namespace trueline {
namespace {

constexpr double kHardlyUncertain = 5.0 * kDegree;  // of a heading, sigma

// The heading with an attitude filter in order, and with one of any gain.
struct HeadingPair {
  Heading ordinary, any;

  bool IsShown(double least) const {
    const double a = std::abs(ordinary.angle), b = std::abs(any.angle);
    const double apart = std::abs(std::remainder(ordinary.angle - any.angle, 2.0 * M_PI));
    const bool zero_between = apart > std::max(a, b);
    return std::min(a, b) > least && !zero_between && ordinary.none_excluded > kLikely &&
           any.none_excluded > kShown;
  }
  bool IsPrecise() const {
    return std::abs(ordinary.angle) > kShown * ordinary.sigma &&
           std::abs(any.angle) > kShown * any.sigma;
  }
};

Finding OffsetOf(const Heading& heading, double gravity) {
  const double error = gravity * std::abs(std::sin(heading.angle));
  const double size = heading.angle / kDegree, sigma = heading.sigma / kDegree;
  const Level level = LevelOfTurn(std::abs(size));
  return {"heading_offset", "attitude", level, size, "deg", error, sigma};
}

void AddOffset(Examination* e, const std::string& stream, const HeadingPair& pair) {
  const Heading& heading = pair.ordinary;
  Finding finding = OffsetOf(heading, e->log.gravity);
  finding.text = fmt::format(
      "north of {}.csv is turned by {:.0f} +- {:.1g} deg from that of attitude.csv, by "
      "changes of velocity: a calibration takes up to {:.0f} deg for an error of the AHRS",
      stream, finding.size, finding.sigma, kAbsorbedHeading / kDegree);
  if (!pair.IsPrecise()) {
    finding.text += fmt::format(
        ". The turn is uncertain: {:.0f} +- {:.0f} deg if the attitude filter takes acceleration "
        "for tilt",
        pair.any.angle / kDegree, pair.any.sigma / kDegree);
    finding.remedy = "check the attitude's north in the map";
    e->Add(finding);
    return;
  }
  // Axes are named in quarter turns; a calibration finds the rest.
  const double quarter = 0.5 * M_PI * std::round(heading.angle / (0.5 * M_PI));
  const bool is_quarter = quarter != 0.0 && std::abs(heading.angle - quarter) < kAbsorbedHeading;
  const double angle = is_quarter ? quarter : heading.angle;
  finding.remedy =
      fmt::format("turn the attitude's earth by {:+.1f} deg about down", angle / kDegree);
  const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitZ());
  const StreamRepair change{.earth = turn.toRotationMatrix()};
  for (const std::string& copy : e->copies) e->Repair(copy, change);
  e->AddRepaired(finding, change);
}

// The headings of both halves of a flight by `shape` times one size: the best size, and chi square.
struct HalvesFit {
  double size, chi2;
};
HalvesFit FitHalves(const Heading& first, const Heading& second, const Eigen::Vector2d& shape) {
  const Eigen::Vector2d sigma(first.sigma, second.sigma);
  const Eigen::Vector2d angle = Eigen::Vector2d(first.angle, second.angle).cwiseQuotient(sigma);
  const Eigen::Vector2d unit = shape.cwiseQuotient(sigma);
  const double size = unit.dot(angle) / unit.squaredNorm();
  return {size, (angle - size * unit).squaredNorm()};
}

// A heading that grows from zero is no offset that a map could turn.
bool AddDrift(Examination* e, const std::string& stream) {
  const std::vector<ImuSample>& imu = e->fixed.imu;
  const TimeNs from = imu.front().t, middle = imu[imu.size() / 2].t, to = imu.back().t;
  const auto first = HeadingOf(PartOf(e->fixed, from, middle), stream, kOrdinaryGain);
  auto second = HeadingOf(PartOf(e->fixed, middle, to), stream, kOrdinaryGain);
  if (!first || !second) return false;
  // Beside half a turn one may be positive and the other negative.
  second->angle = first->angle + std::remainder(second->angle - first->angle, 2.0 * M_PI);
  const HalvesFit offset = FitHalves(*first, *second, {1.0, 1.0}),
                  drift = FitHalves(*first, *second, {0.25, 0.75});
  if (offset.chi2 < drift.chi2) return false;
  const double seconds = SecondsBetween(from, to);
  const double sigma = std::hypot(first->sigma, second->sigma) / (0.5 * seconds);
  Finding finding{"heading_drift", "attitude",
                  Level::kBiases,  drift.size / kDegree / seconds,
                  "deg/s",         e->log.gravity * std::abs(std::sin(drift.size)),
                  sigma / kDegree};
  finding.text = fmt::format(
      "the heading of attitude.csv drifts rather than being turned: north of {}.csv is off by "
      "{:.0f} +- {:.1g} deg in the first half of the flight, by {:.0f} +- {:.1g} deg in the second",
      stream, first->angle / kDegree, first->sigma / kDegree, second->angle / kDegree,
      second->sigma / kDegree);
  finding.remedy = "trueline diagnose tells a drift from an error that goes with the heading";
  e->Add(finding);
  return true;
}

// Passes alone do not tell an attitude of another heading from an accelerometer of other axes.
void AddUndecided(Examination* e, const std::string& stream, const Heading& heading,
                  const TurnedForce& other) {
  Finding finding = OffsetOf(heading, e->log.gravity);
  finding.level = Level::kFatal;
  finding.text = fmt::format(
      "the changes of velocity of {}.csv do not fit attitude and accelerometer as read: either "
      "north of attitude.csv is turned by {:.0f} +- {:.1g} deg ({:.0f} % explained), or the "
      "accelerometer's axes are {} ({:.0f} %). The log does not show which of the two is wrong",
      stream, finding.size, finding.sigma, 100.0 * (1.0 - heading.left), AxesText(other.turn),
      100.0 * (1.0 - other.heading.left));
  finding.remedy = "check the axes of the accelerometer and the attitude's north in the map";
  e->Add(finding);
}

void NoteUndecided(Examination* e, const std::string& stream, const HeadingPair& pair) {
  e->result.notes.push_back(fmt::format(
      "the heading of {}.csv against that of attitude.csv: {:.0f} +- {:.0f} deg for an attitude "
      "filter in order, {:.0f} +- {:.0f} deg for one that may take acceleration for tilt "
      "(ahrs_acceleration_error). An offset of the heading and such a filter look alike here",
      stream, pair.ordinary.angle / kDegree, pair.ordinary.sigma / kDegree,
      pair.any.angle / kDegree, pair.any.sigma / kDegree));
}

// An attitude filter that takes acceleration for tilt turns at other rates than the gyroscope,
// which looks like a small turn of the IMU.
bool MayFollowAcceleration(const Examination& e) {
  const Eigen::Matrix3d turn = e.RepairOf("imu").gyro;
  return !IsIdentity(turn) && TurnSize(turn) < kTurnByFilter / kDegree;
}

}  // namespace

void CheckHeading(Examination* e) {
  if (e->fixed.attitude.size() < kFewest) return;
  for (const char* stream : {"mocap", "fixes"}) {
    // By another clock, which may be a lap off, they are compared once that is repaired.
    if (e->RepairOf(stream).time_offset != 0.0) continue;
    const auto heading = HeadingOf(e->fixed, stream, kOrdinaryGain);
    if (!heading) continue;
    const bool small = std::abs(heading->angle) < e->other_axes;
    if (small && heading->sigma < kHardlyUncertain) return;
    const auto any = HeadingOf(e->fixed, stream, kAnyGain);
    if (!any) continue;
    const HeadingPair pair{*heading, *any};
    if (!pair.IsShown(e->other_axes) || MayFollowAcceleration(*e)) {
      NoteUndecided(e, stream, pair);
      return;
    }
    if (AddDrift(e, stream)) return;
    const auto other =
        std::string(stream) == "fixes" ? BestLateralTurn(e->fixed, stream, 1.0) : std::nullopt;
    if (other && other->heading.left < kAlikeRest * heading->left) {
      AddUndecided(e, stream, *heading, *other);
    } else {
      AddOffset(e, stream, pair);
    }
    return;
  }
  if (e->fixed.fixes.empty() && e->fixed.mocap.empty()) return;
  e->result.notes.emplace_back(
      "the heading of the positions against that of attitude.csv: the acceleration does not show "
      "it");
}

}  // namespace trueline
