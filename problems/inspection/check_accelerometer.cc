#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/lateral_axes.h"
#include "problems/inspection/position_witness.h"

namespace trueline {
namespace {

constexpr double kMostGravities = 5.0;  // rms acceleration of a flight
// rad, by which an IMU is usually mounted askew: a horizontal bias for gravity's part along x and
// y.
constexpr double kUsualTilt = 2.5 * kDegree;
// A flight whose thrust hardly varies does not tell a scale from a bias of the vertical axis. Such
// a bias is then a scale if it is larger than sensors have: makers state up to 80 mg along z.
constexpr double kMostBias = 0.85;  // m/s^2
constexpr double kUpright = 0.35;   // horizontal over vertical part of the bias
// rad, by which a force seems turned if an axis reads another multiple of it.
constexpr double kTurnOfForce = 30.0 * kDegree;

// The residual if the earth axes of position were turned instead.
double ResidualOfEarthTurn(const Examination& e, const PositionWitness& witness,
                           std::vector<Bend> bends) {
  const auto match = MatchBends(e, witness.attitude, bends);
  if (!match) return std::numeric_limits<double>::infinity();
  TurnBends(match->turn.transpose(), &bends);
  return ForceResidual(BodyForce(e.fixed, witness.attitude), bends, Eigen::Matrix3d::Identity());
}

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
  Repairs alone;
  alone.streams["imu"] = back;
  FlightLog as_read = e->fixed;
  ApplyRepairs(alone, e->sources, &as_read);
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
                      kMuchLess * ForceResidual(force, other, Eigen::Matrix3d::Identity());
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
  const bool better = fit->residual < kMuchLess * fit->as_read &&
                      fit->as_read - fit->residual > kForceError && fit->clearly > kShown;
  if (turn.isIdentity(1e-9) || !better || !HoldsInOtherHalf(force, bends, hints)) return;
  if (ResidualOfEarthTurn(*e, witness, bends) < 1.1 * fit->residual) return;
  const double size = TurnSize(turn);
  Finding finding{.level = LevelOfTurn(size), .size = size, .error = fit->as_read - fit->residual};
  finding.text = fmt::format(
      "the accelerometer's axes are not the body's: taken as {}, {}, it leaves {:.2f} m/s^2 (rms) "
      "of the acceleration of {} unexplained, otherwise {:.2f}",
      AxesText(turn),
      e->RepairOf("imu").accel.isIdentity(1e-9) ? "the gyroscope's left as they are"
                                                : "beside the gyroscope's repair",
      fit->residual, witness.stream, fit->as_read);
  finding.remedy = "take the accelerometer's axes so";
  AddAccelerometerAxes(e, turn, finding);
}

void AddBias(Examination* e, const Eigen::Vector3d& bias, const std::string& stream) {
  Finding finding{"accelerometer_bias", "imu", Level::kBiases, bias.norm(), "m/s^2", bias.norm()};
  finding.text = fmt::format(
      "the accelerometer reads ({:.2f}, {:.2f}, {:.2f}) m/s^2 too much, by the acceleration of {}",
      -bias.x(), -bias.y(), -bias.z(), stream);
  finding.remedy =
      "the calibration estimates it; a bias above 1 m/s^2 asks for a calibration of the "
      "sensor at rest";
  e->Add(finding);
}

// m/s^2, of a bias that no usual misalignment explains.
double BeyondTilt(const Eigen::Vector3d& bias, double gravity) {
  const double across = bias.head<2>().norm() - gravity * std::sin(kUsualTilt);
  return std::hypot(std::max(0.0, across), bias.z());
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
  if (!fit || BeyondTilt(fit->bias, e->log.gravity) > kForceError) return bias;
  e->result.notes.push_back(fmt::format(
      "a bias of the accelerometer of {:.2f} m/s^2, by the acceleration of {}: an attitude filter "
      "that takes acceleration for tilt with a gain of {:.2g} 1/s (ahrs_acceleration_error) "
      "explains as much",
      bias.norm(), witness.stream, filter->gain));
  return fit->bias;
}

// True if the fit is of a scale rather than of a bias.
bool IsScale(const ForceScale& fit) {
  if (fit.by_factor < fit.by_bias) return true;
  return std::abs(fit.bias.z()) > kMostBias && fit.by_factor < kAlikeRest * fit.by_bias &&
         fit.bias.head<2>().norm() < kUpright * std::abs(fit.bias.z());
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
  if (ReadsGravity(e->fixed) && BeyondTilt(fit->bias, e->log.gravity) > kForceError) {
    const Eigen::Vector3d bias = BiasBesideFilter(e, witness, bends, fit->bias);
    if (BeyondTilt(bias, e->log.gravity) > kForceError) AddBias(e, bias, witness.stream);
  }
  return false;
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
      e, 1.0 / reads, 0.02,
      "by its mean in earth axes, which is gravity; without positions a bias of the vertical "
      "axis looks the same");
}

}  // namespace

void AddAccelerometerScale(Examination* e, double factor, double sigma, const std::string& why) {
  const KnownUnit* unit = UnitNear("m/s^2", factor);
  const double error = e->log.gravity * std::abs(1.0 - 1.0 / factor);
  const Level level = unit != nullptr ? Level::kFatal : Level::kBiases;
  Finding finding{"accelerometer_scale", "imu", level, 1.0 / factor, "1", error};
  finding.sigma = sigma / (factor * factor);
  finding.text =
      fmt::format("the accelerometer reads {:.3g} of the specific force; {}", finding.size, why);
  finding.remedy = unit != nullptr
                       ? fmt::format("state its unit, or multiply its readings by {:.6g}{}",
                                     unit->factor, UnitText(unit))
                       : fmt::format(
                             "multiply its readings by {:.4f}; check the unit (g is 9.80665 m/s^2) "
                             "and the range",
                             factor);
  finding.repaired = true;
  e->Repair("imu", {.accel_scale = unit != nullptr ? unit->factor : factor});
  e->Add(finding);
}

void AddAccelerometerAxes(Examination* e, const Eigen::Matrix3d& turn, Finding finding) {
  finding.id = "accelerometer_axes";
  finding.stream = "imu";
  finding.unit = "deg";
  finding.repaired = true;
  e->Repair("imu", {.accel = turn});
  e->Add(std::move(finding));
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
    e->other_axes = kTurnOfForce;
    return;
  }
  CheckMeanForce(e);
}

}  // namespace trueline
