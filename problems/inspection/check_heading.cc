#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/heading.h"

namespace trueline {
namespace {

// The AHRS may err by some degrees, and this comparison as well.
constexpr double kMostHeading = 10.0 * kDegree;
// Calibration takes as much for an error of the AHRS. It does not find a larger one, and drag and
// misalignment come out wrong.
constexpr double kFoundByFit = 6.0 * kDegree;
constexpr double kOtherHeading = 15.0 * kDegree;
constexpr double kAlikeLeft = 1.1;       // of the share that two explanations leave
constexpr double kHeadingClearly = 4.0;  // sigmas

Finding OffsetOf(const Heading& heading, double gravity) {
  Finding finding;
  finding.id = "heading_offset";
  finding.stream = "attitude";
  finding.level = std::abs(heading.angle) > kOtherHeading ? Level::kFatal : Level::kBiases;
  finding.size = heading.angle / kDegree;
  finding.sigma = heading.sigma / kDegree;
  finding.unit = "deg";
  finding.error = gravity * std::abs(std::sin(heading.angle));
  return finding;
}

void TurnAttitude(Examination* e, const std::string& stream, const Heading& heading) {
  Finding finding = OffsetOf(heading, e->log.gravity);
  finding.text = fmt::format(
      "north of {}.csv is turned by {:.0f} +- {:.1g} deg from that of attitude.csv, by "
      "changes of velocity: a calibration takes up to {:.0f} deg for an error of the AHRS",
      stream, finding.size, finding.sigma, kFoundByFit / kDegree);
  finding.remedy = fmt::format("turn the attitude's earth by {:+.1f} deg about down", finding.size);
  finding.repaired = true;
  StreamRepair change;
  change.earth = Eigen::AngleAxisd(heading.angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  e->Repair("attitude", change);
  for (const std::string& copy : e->copies) e->Repair(copy, change);
  e->Add(finding);
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

}  // namespace

void CheckHeading(Examination* e) {
  if (e->fixed.attitude.size() < 30) return;
  for (const char* stream : {"mocap", "fixes"}) {
    // By another clock, which may be a lap off, they are compared once that is repaired.
    if (e->HasFinding("clock_offset", stream)) continue;
    const auto heading = HeadingOf(e->fixed, stream);
    if (!heading) continue;
    // A force along an axis that reads another multiple points elsewhere.
    const double most = e->HasFinding("lateral_force", "imu") ? kTurnOfForce : kMostHeading;
    const double least = std::max(most, kHeadingClearly * heading->sigma);
    if (std::abs(heading->angle) < least) return;
    const auto other =
        std::string(stream) == "fixes" ? BestLateralTurn(e->fixed, stream, 1.0) : std::nullopt;
    if (other && other->heading.left < kAlikeLeft * heading->left) {
      AddUndecided(e, stream, *heading, *other);
    } else {
      TurnAttitude(e, stream, *heading);
    }
    return;
  }
  if (e->fixed.fixes.empty() && e->fixed.mocap.empty()) return;
  e->result.notes.emplace_back(
      "the heading of the positions against that of attitude.csv: the acceleration does not show "
      "it");
}

}  // namespace trueline
