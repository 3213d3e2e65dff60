#include "problems/inspection/lateral_axes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

// Factors of the bends' width. The noise of readings makes shares smaller, the less so the wider
// the bends are; a wrong scale is the same at all widths.
constexpr double kWidths[] = {1.0, 2.0, 3.0};
constexpr double kMostNoise = 0.2;  // m; bends for more noise are too wide for the body's turns
constexpr LagSearch kPositionLag = {0.5};  // s
constexpr double kLeastShare = 0.5;        // of a reading in a lateral force
constexpr double kMostThrust = 0.3;        // share of z, beyond which more than x and y is turned
constexpr double kLateralForce = 1.0;      // m/s^2, of drag at racing speed
constexpr double kLowShare = 0.65, kHighShare = 1.5;  // of an axis that reads another multiple

// The positions at one width of bends, as they are and in the axes that are nearest to the
// attitude's earth.
struct Look {
  PositionWitness witness;
  std::vector<Bend> as_read, turned;
};

// The clock of mocap and poses is known by their turns. Fixes that are late take a part of thrust
// for a lateral force.
void RemoveLag(const Examination& e, PositionWitness* witness) {
  const RunningIntegral<3> force = ForceIntegral(e.fixed, witness->attitude);
  const auto match = MatchVectors(AccelerationPairs(force, witness->bends), kPositionLag);
  if (!match) return;
  for (Bend& bend : witness->bends) bend.t -= match->lag;
}

std::vector<Look> LooksAt(const Examination& e, const std::string& stream) {
  std::vector<Look> looks;
  for (const double wider : kWidths) {
    auto witness = PositionWitnessOf(e, stream, wider);
    if (!witness || witness->noise > kMostNoise) continue;
    if (stream == "fixes") RemoveLag(e, &*witness);
    const auto bends = InEarthOfAttitude(e, *witness);
    if (!bends) continue;
    looks.push_back({*witness, *bends, *bends});
    TurnLikePositions(e, *witness, &looks.back().turned);
  }
  return looks;
}

// The signed axis of the readings that the body's axis `row` is made of; 0 where the flight does
// not show it.
Eigen::RowVector2d ShownAxis(const LateralForce& fit, int row) {
  for (int k = 0; k < 2; ++k) {
    const double share = fit.share(row, k), other = fit.share(row, 1 - k);
    if (std::abs(share) < std::max(kLeastShare, kShown * fit.sigma(row, k))) continue;
    if (std::abs(other) < 0.5 * std::abs(share)) {
      return std::copysign(1.0, share) * Eigen::RowVector2d::Unit(k);
    }
  }
  return Eigen::RowVector2d::Zero();
}

struct ShownAxes {
  LateralForce fit;
  Eigen::Matrix2d of;  // rows by ShownAxis()

  bool AreStated() const {
    return (of.diagonal().array() >= 0.0).all() && of(0, 1) == 0.0 && of(1, 0) == 0.0;
  }
  bool AreBothShown() const { return std::abs(std::abs(of.determinant()) - 1.0) < 1e-9; }
  Eigen::Matrix3d Turn() const {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    turn.topLeftCorner<2, 2>() = of;
    return turn;
  }
};

std::optional<ShownAxes> AxesBy(const BodyForce& force, const std::vector<Bend>& bends) {
  const auto fit = FitLateralForce(force, bends);
  if (!fit || fit->share.col(2).cwiseAbs().maxCoeff() > kMostThrust) return std::nullopt;
  ShownAxes shown{*fit, {}};
  shown.of << ShownAxis(*fit, 0), ShownAxis(*fit, 1);
  return shown;
}

// Of positions as read, if their accelerometer turned explains more than positions turned do.
std::optional<ShownAxes> BestAxes(const BodyForce& force, const Look& look) {
  const auto as_read = AxesBy(force, look.as_read);
  if (as_read && !as_read->AreStated() && as_read->AreBothShown() &&
      ForceResidual(force, look.as_read, as_read->Turn()) <
          ForceResidual(force, look.turned, Eigen::Matrix3d::Identity())) {
    return as_read;
  }
  return AxesBy(force, look.turned);
}

std::string ShareText(const LateralForce& fit, int row) {
  return fmt::format("{}'s is {:+.2f} +- {:.2f} of x and {:+.2f} +- {:.2f} of y", "xy"[row],
                     fit.share(row, 0), fit.sigma(row, 0), fit.share(row, 1), fit.sigma(row, 1));
}

void AddExchange(Examination* e, const std::string& stream, const ShownAxes& shown) {
  Finding finding{.level = Level::kFatal, .size = 180.0, .error = kLateralForce};
  finding.text = fmt::format(
      "the accelerometer's x and y are not the body's: by the acceleration of {}, of the force "
      "along the body's axes {}, {}",
      stream, ShareText(shown.fit, 0), ShareText(shown.fit, 1));
  finding.remedy = fmt::format("take the accelerometer's axes as {}", AxesText(shown.Turn()));
  AddAccelerometerAxes(e, shown.Turn(), finding);
}

// The share of an axis where it is off by as much at every width; none else.
std::optional<double> OffShare(const std::vector<ShownAxes>& all, int axis) {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (const ShownAxes& shown : all) {
    const double share = shown.fit.share(axis, axis);
    if (std::abs(share - 1.0) < kShown * shown.fit.sigma(axis, axis)) return std::nullopt;
    lowest = std::min(lowest, share);
    highest = std::max(highest, share);
  }
  if (all.size() < std::size(kWidths) || (highest > kLowShare && lowest < kHighShare)) {
    return std::nullopt;
  }
  return all.back().fit.share(axis, axis);
}

Finding ScaleOf(const PositionWitness& witness, int axis, const LateralForce& fit) {
  const double share = fit.share(axis, axis), sigma = fit.sigma(axis, axis);
  Finding finding{"lateral_force", "imu", Level::kBiases, share, "1", kLateralForce, sigma};
  finding.text = fmt::format(
      "the force along the body's {} that {} shows is {:.2g} +- {:.1g} times what the "
      "accelerometer reads along it",
      "xy"[axis], witness.stream, finding.size, finding.sigma);
  finding.remedy =
      "check the scale of this axis; drag is read from it (drag_measurement: {enabled: false} "
      "leaves both out)";
  return finding;
}

// A filter that knows no drag tilts the force as much as a wrong scale does.
void NoteFilter(Examination* e, const Finding& finding) {
  e->result.notes.push_back(
      "whether an axis of the accelerometer reads another multiple: " + finding.text +
      ", and an attitude filter that knows no drag (ahrs_drag_error) does as much");
}

void NoteUnshown(Examination* e, const std::string& stream) {
  e->result.notes.push_back(fmt::format(
      "which of the accelerometer's axes are the body's x and y: the acceleration of {} does not "
      "show the lateral force",
      stream));
}

}  // namespace

std::vector<Finding> CheckLateralAxes(Examination* e, const std::string& stream) {
  std::vector<Finding> findings;
  const std::vector<Look> looks = LooksAt(*e, stream);
  if (looks.empty()) {
    NoteUnshown(e, stream);
    return findings;
  }
  const BodyForce force(e->fixed, looks.front().witness.attitude);
  std::vector<ShownAxes> all;
  for (const Look& look : looks) {
    const auto shown = BestAxes(force, look);
    if (shown && !shown->AreStated() && shown->AreBothShown()) {
      AddExchange(e, stream, *shown);
      return findings;
    }
    if (shown) all.push_back(*shown);
  }
  bool any = false;
  for (int axis = 0; axis < 2; ++axis) {
    if (OffShare(all, axis)) {
      const PositionWitness& witness = looks.back().witness;
      const Finding finding = ScaleOf(witness, axis, all.back().fit);
      if (IsOfAhrs(*e, witness)) {
        NoteFilter(e, finding);
      } else {
        findings.push_back(finding);
      }
    }
    for (const ShownAxes& shown : all) any = any || shown.of(axis, axis) > 0.0;
  }
  if (!any) NoteUnshown(e, stream);
  return findings;
}

}  // namespace trueline
