#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

constexpr double kMostGravities = 5.0;  // rms acceleration of a flight

Eigen::Matrix3d Snapped(const Eigen::Matrix3d& turn) {
  for (const Eigen::Matrix3d& m : SignedPermutations()) {
    if ((m.determinant() > 0.0) != (turn.determinant() > 0.0)) continue;
    if (TurnBetween(turn, m).norm() < kOtherAxes) return m;
  }
  return turn;
}

// Takes back what CheckBodies() did to the accelerometer for the gyroscope's sake, if position is
// better explained without it.
void JudgeAssumedAxes(Examination* e, const PositionWitness& witness,
                      const std::vector<Bend>& bends) {
  const Eigen::Matrix3d assumed = e->RepairOf("imu").accel;
  if (assumed.isIdentity(1e-9)) return;
  const StreamRepair back{.accel = assumed.transpose()};
  FlightLog as_read = e->fixed;
  ApplyRepair("imu", back, e->sources, &as_read);
  const auto residual = [&](const FlightLog& log) {
    return ForceResidual(BodyForce(log, witness.attitude), bends, Eigen::Matrix3d::Identity());
  };
  if (residual(as_read) < residual(e->fixed)) e->Repair("imu", back);
}

// Whether the turn that fits one half of the flight explains the other half as well, both ways.
bool HoldsInOtherHalf(const BodyForce& force, const std::vector<Bend>& bends,
                      const std::vector<Eigen::Matrix3d>& hints) {
  const auto middle = bends.begin() + static_cast<std::ptrdiff_t>(bends.size() / 2);
  const std::vector<Bend> first(bends.begin(), middle), second(middle, bends.end());
  const auto holds = [&](const std::vector<Bend>& fitted, const std::vector<Bend>& other) {
    const auto fit = FitForce(force, fitted, hints);
    return fit && ForceResidual(force, other, Snapped(fit->turn)) <
                      kExplains * ForceResidual(force, other, Eigen::Matrix3d::Identity());
  };
  return holds(first, second) && holds(second, first);
}

void CheckAxes(Examination* e, const PositionWitness& witness, const std::vector<Bend>& bends) {
  std::vector<Eigen::Matrix3d> hints;
  for (const RateWitness& rate : e->rates) {
    hints.push_back(rate.turn);
    hints.push_back(rate.turn.transpose());
  }
  const BodyForce force(e->fixed, witness.attitude);
  const auto fit = FitForce(force, bends, hints);
  if (!fit) return;
  const Eigen::Matrix3d turn = Snapped(fit->turn);
  const bool better = fit->residual < kExplains * fit->as_read &&
                      fit->as_read - fit->residual > kForceError && fit->clearly > kShown;
  if (turn.isIdentity(1e-9) || !better || !HoldsInOtherHalf(force, bends, hints)) return;
  // The earth axes of position may be turned instead.
  if (ResidualOfTurnedBends(e->fixed, witness.attitude, bends) < kAlikeRest * fit->residual) return;
  AddAccelerometerAxes(
      e, turn, fit->as_read - fit->residual,
      fmt::format("the accelerometer's axes are not the body's: taken as {}, {}, it leaves {:.2f} "
                  "m/s^2 (rms) of the acceleration of {} unexplained, otherwise {:.2f}",
                  AxesText(turn),
                  e->RepairOf("imu").accel.isIdentity(1e-9) ? "the gyroscope's left as they are"
                                                            : "beside the gyroscope's repair",
                  fit->residual, witness.stream, fit->as_read));
}

void AddBias(Examination* e, const Eigen::Vector3d& bias, const std::string& stream) {
  e->Add({&fault::kAccelerometerBias, "imu", Level::kBiases, bias.norm(), bias.norm()},
         fmt::format("the accelerometer is off by ({:.2f}, {:.2f}, {:.2f}) m/s^2, by the "
                     "acceleration of {}",
                     -bias.x(), -bias.y(), -bias.z(), stream),
         "the calibration estimates it; a bias above 1 m/s^2 asks for a calibration of the "
         "sensor at rest");
}

// Whether a bias is a fault. Gravity's part along x and y of an IMU that is mounted askew looks
// like a horizontal one.
bool IsBiased(const Eigen::Vector3d& bias) {
  return std::hypot(std::max(0.0, bias.head<2>().norm() - kForceError), bias.z()) > kForceError;
}

// The bias beside the error of an AHRS that follows acceleration: its tilt in a steady turn is one
// in the body.
Eigen::Vector3d BiasBesideFilter(Examination* e, const PositionWitness& witness,
                                 const std::vector<Bend>& bends, const Eigen::Vector3d& bias) {
  if (!IsOfAhrs(*e, witness)) return bias;
  const auto filter = FollowingOf(*e, witness, 0.0);
  if (!filter) return bias;
  const auto attitude = WithoutFollowing(e->fixed, witness.attitude, filter->gain);
  const auto fit = FitForceScale(BodyForce(e->fixed, attitude), bends);
  if (!fit || IsBiased(fit->bias)) return bias;
  e->result.notes.push_back(fmt::format(
      "a bias of the accelerometer of {:.2f} m/s^2, by the acceleration of {}: an attitude filter "
      "that takes acceleration for tilt with a gain of {:.2g} 1/s (ahrs_acceleration_error) "
      "explains as much",
      bias.norm(), witness.stream, filter->gain));
  return fit->bias;
}

// True if the fit is of a scale rather than of a bias. A flight whose thrust hardly varies does not
// tell the two apart: a bias along z is then a scale if it is larger than sensors have, of which
// makers state up to 80 mg.
bool IsScale(const ForceScale& fit) {
  if (fit.by_factor < fit.by_bias) return true;
  return std::abs(fit.bias.z()) > 2.0 * kForceError && fit.by_factor < kAlikeRest * fit.by_bias &&
         fit.bias.head<2>().norm() < kLittle * std::abs(fit.bias.z());
}

// Returns whether the scale is repaired.
bool CheckScale(Examination* e, const PositionWitness& witness, std::vector<Bend> bends) {
  TurnLikePositions(*e, witness, &bends);
  const auto fit = FitForceScale(BodyForce(e->fixed, witness.attitude), bends);
  if (!fit) return false;
  const double off = std::abs(fit->factor - 1.0);
  if (off > kOtherScale && off > kShown * fit->sigma && IsScale(*fit)) {
    AddAccelerometerScale(
        e, fit->factor, fit->sigma,
        fmt::format("a scale leaves {:.3f} m/s^2 (rms) of the acceleration of {} unexplained, "
                    "a bias {:.3f}",
                    fit->by_factor, witness.stream, fit->by_bias));
    return true;
  }
  // Without gravity a bias of its size says the same.
  if (ReadsGravity(e->fixed) && IsBiased(fit->bias)) {
    const Eigen::Vector3d bias = BiasBesideFilter(e, witness, bends, fit->bias);
    if (IsBiased(bias)) AddBias(e, bias, witness.stream);
  }
  return false;
}

// Factors of the bends' width. The noise of readings makes shares smaller, the less so the wider
// the bends are; a wrong scale is the same at all widths.
constexpr double kWidths[] = {1.0, 2.0, 3.0};
constexpr double kMostNoise = 0.2;     // m; bends for more noise are too wide for the body's turns
constexpr double kLateralForce = 1.0;  // m/s^2, of drag at racing speed
constexpr double kOtherShare = 1.5;    // of an axis that reads another multiple, or one over it

// The positions at one width of bends, as they are and in the axes that are nearest to the
// attitude's earth.
struct Look {
  PositionWitness witness;
  std::vector<Bend> as_read, turned;
};

// The clock of mocap and poses is known by their turns. Fixes that are late take a part of thrust
// for a lateral force.
void RemoveLag(const Examination& e, PositionWitness* witness) {
  const auto match = MatchBends(e.fixed, witness->attitude, witness->bends, LagSearch{kNearLag});
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
    if (std::abs(share) < std::max(kMajority, kShown * fit.sigma(row, k))) continue;
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
  if (!fit || fit->share.col(2).cwiseAbs().maxCoeff() > kLittle) return std::nullopt;
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
  return fmt::format("along {} it is {:+.2f} +- {:.2f} of x and {:+.2f} +- {:.2f} of y", "xy"[row],
                     fit.share(row, 0), fit.sigma(row, 0), fit.share(row, 1), fit.sigma(row, 1));
}

void AddExchange(Examination* e, const std::string& stream, const ShownAxes& shown) {
  AddAccelerometerAxes(
      e, shown.Turn(), kLateralForce,
      fmt::format("the accelerometer's x and y are not the body's: the force that the acceleration "
                  "of {} shows is another mixture of its readings, {}, {}",
                  stream, ShareText(shown.fit, 0), ShareText(shown.fit, 1)));
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
  if (all.size() < std::size(kWidths) || (highest * kOtherShare > 1.0 && lowest < kOtherShare)) {
    return std::nullopt;
  }
  return all.back().fit.share(axis, axis);
}

Finding ScaleOf(const PositionWitness& witness, int axis, const LateralForce& fit) {
  const double share = fit.share(axis, axis), sigma = fit.sigma(axis, axis);
  return {&fault::kLateralForce,
          "imu",
          Level::kBiases,
          share,
          kLateralForce,
          sigma,
          fmt::format("the force along the body's {} that {} shows is {:.2g} +- {:.1g} times what "
                      "the accelerometer reads along it",
                      "xy"[axis], witness.stream, share, sigma),
          "check the scale of this axis; drag is read from it (drag_measurement: {enabled: false} "
          "leaves both out)"};
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

// Drag is read from these axes and from nothing else. Their part of the acceleration is small
// beside that of thrust, so a wrong one hardly shows in the residual of all axes. Where the
// flight shows both, finds and repairs x and y exchanged or of the other sign; finds an axis that
// reads another multiple of the force: these findings are returned, since a scale of all axes may
// explain them. `stream`: of the positions, with an attitude.
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

// Without positions: the mean of the specific force, turned to earth axes, is gravity.
void CheckMeanForce(Examination* e) {
  const std::vector<AttitudeSample>& attitude = e->fixed.attitude;
  if (attitude.size() < kFewest) return;
  const auto mean = MeanForceInEarth(e->fixed, attitude, 1.0);
  if (!mean || SecondsBetween(attitude.front().t, attitude.back().t) < 15.0) return;
  const double reads = -mean->z() / e->log.gravity;
  if (std::abs(reads - 1.0) < kOtherScale) return;
  if (reads < 0.3 && UnitNear("m/s^2", 1.0 / reads) == nullptr) return;
  AddAccelerometerScale(
      e, 1.0 / reads, kErrorOfMean / reads,
      "by its mean in earth axes, which is gravity; without positions a bias of the vertical "
      "axis looks the same");
}

}  // namespace

void AddAccelerometerScale(Examination* e, double factor, double sigma, const std::string& why) {
  const double reads = 1.0 / factor;
  AddScale(e, &StreamRepair::accel_scale, factor, UnitNear("m/s^2", factor),
           {&fault::kAccelerometerScale, "imu", Level::kBiases, reads,
            e->log.gravity * std::abs(1.0 - reads), sigma * reads * reads},
           fmt::format("the accelerometer reads {:.3g} of the specific force; {}", reads, why));
}

void AddAccelerometerAxes(Examination* e, const Eigen::Matrix3d& turn, double error,
                          const std::string& text) {
  const double size = TurnSize(turn);
  e->AddRepaired({&fault::kAccelerometerAxes, "imu", LevelOfTurn(size), size, error}, text,
                 fmt::format("take the accelerometer's axes as {}", AxesText(turn)),
                 {.accel = turn});
}

void CheckAccelerometer(Examination* e) {
  for (const char* stream : {"mocap", "pose", "fixes"}) {
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    auto bends = InEarthOfAttitude(*e, *witness);
    if (!bends) continue;
    // Of another unit, which CheckPositions() says.
    if (RmsAcceleration(*bends) > kMostGravities * e->log.gravity) return;
    JudgeAssumedAxes(e, *witness, *bends);
    CheckAxes(e, *witness, *bends);
    const std::vector<Finding> lateral = CheckLateralAxes(e, stream);
    bends = InEarthOfAttitude(*e, *witness);
    // A scale of all axes explains that of one.
    if ((bends && CheckScale(e, *witness, *bends)) || lateral.empty()) return;
    for (const Finding& finding : lateral) e->Add(finding);
    e->other_axes = kClearTurn;
    return;
  }
  CheckMeanForce(e);
}

}  // namespace trueline
