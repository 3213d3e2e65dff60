#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/heading.h"
#include "problems/inspection/position_witness.h"
#include "problems/log/attitude_cursor.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kCalmRate = 0.5;   // rad/s
constexpr double kCalmForce = 1.5;  // m/s^2, from gravity
constexpr double kLeastCalm = 2.0;  // s
constexpr double kAlong = 0.85;     // cosine of a direction that is along an axis
constexpr double kLeastLean = 60.0 * kDegree;
constexpr double kErrorOfMean = 0.02;  // of gravity, by the mean force

// Mean specific force (m/s^2) over the calm parts, in the body or, by an attitude, in its earth;
// zero where there are too few.
Eigen::Vector3d CalmForce(const FlightLog& log, const std::vector<AttitudeSample>* attitude) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (attitude != nullptr && attitude->empty()) return sum;
  std::optional<AttitudeCursor> cursor;
  if (attitude != nullptr) cursor.emplace(*attitude);
  double calm = 0.0, n = 0.0;
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    const ImuSample& s = log.imu[i];
    if (s.gyro.norm() > kCalmRate || std::abs(s.accel.norm() - log.gravity) > kCalmForce) continue;
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    if (cursor && !cursor->At(s.t, kAttitudeGap, &q)) continue;
    calm += std::min(0.1, SecondsBetween(log.imu[i - 1].t, s.t));
    sum += q * s.accel;
    n += 1.0;
  }
  return calm < kLeastCalm ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(sum / n);
}

Eigen::Vector3d ForceBy(const Examination& e, const std::string& stream) {
  const std::vector<AttitudeSample> attitude = AttitudesOf(e.fixed, stream);
  return CalmForce(e.fixed, &attitude);
}

// The mean force in earth is gravity, in the unit of the readings. Where gravity is taken out it is
// nearly zero. Repairs a known unit.
void CheckGravityUnit(Examination* e) {
  if (e->rates.empty() || ReadsGravity(e->fixed)) return;
  const auto mean = MeanForceInEarth(e->fixed, AttitudesOf(e->fixed, e->rates.front().stream), 1.0);
  if (!mean || !(mean->norm() > 0.0)) return;
  const double factor = e->log.gravity / mean->norm();
  if (UnitNear("m/s^2", factor) == nullptr) return;
  AddAccelerometerScale(
      e, factor, kErrorOfMean * factor,
      fmt::format("by its mean in the earth of {}.csv, which is gravity", e->rates.front().stream));
}

// Median size (m/s^2) of the specific force.
double UsualForce(const FlightLog& log) {
  std::vector<double> sizes;
  sizes.reserve(log.imu.size());
  for (const ImuSample& s : log.imu) sizes.push_back(s.accel.norm());
  return LowerMedian(sizes);
}

bool IsOfGravity(double force, const FlightLog& log) { return !(force < 0.5 * log.gravity); }

// Some autopilots log the acceleration with gravity taken out, which has no mean in earth.
void CheckGravityMissing(Examination* e) {
  const double usual = UsualForce(e->fixed);
  if (IsOfGravity(usual, e->log)) return;
  Finding finding{"gravity_missing", "imu", Level::kFatal, usual, "m/s^2", e->log.gravity};
  finding.text = fmt::format(
      "the accelerometer reads {:.2f} m/s^2 (median of its size), where a vehicle in flight reads "
      "about {:.1f}: gravity is taken out, or it is in another unit",
      usual, e->log.gravity);
  finding.remedy =
      "log the specific force, with gravity, or check the unit; without one calibrate "
      "with --thrust=level_flight";
  e->Add(finding);
}

// The rotation among the signed permutations that takes `force` nearest to -z by the least angle.
Eigen::Matrix3d ToUpright(const Eigen::Vector3d& force) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& m : SignedPermutations()) {
    if (m.determinant() < 0.0 || -(m * force).z() < kAlong * force.norm()) continue;
    // Forward stays forward where that is possible, as from FLU to FRD.
    const double angle = TurnBetween(m, Eigen::Matrix3d::Identity()).norm() - 0.1 * m(0, 0);
    if (angle < least) {
      least = angle;
      best = m;
    }
  }
  return best;
}

// Whether an attitude that agrees with the gyroscope has the body upright on average.
bool IsUprightByAttitude(const Examination& e) {
  if (e.rates.empty()) return false;
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  const std::vector<AttitudeSample> attitude = AttitudesOf(e.fixed, e.rates.front().stream);
  for (const AttitudeSample& sample : attitude) {
    up -= sample.q_Ep_I.conjugate() * Eigen::Vector3d::UnitZ();
  }
  return -up.z() > kAlong * static_cast<double>(attitude.size());
}

void CheckBodyUp(Examination* e) {
  const Eigen::Vector3d force = CalmForce(e->fixed, nullptr);
  if (force.norm() < 0.5 * e->log.gravity) return;
  const double lean = LeanOf(force);
  if (lean < kLeastLean) return;
  // Then the accelerometer alone is turned, which CheckAccelerometer() or CheckGravity() says.
  if (IsUprightByAttitude(*e)) return;
  const Eigen::Matrix3d repair = ToUpright(force);
  const double error = e->log.gravity * 2.0 * std::sin(0.5 * lean);
  Finding finding{"body_up", "imu", Level::kFatal, lean / kDegree, "deg", error};
  finding.text = fmt::format(
      "in calm flight or at rest the specific force is ({:.1f}, {:.1f}, {:.1f}) m/s^2, where a "
      "body in forward-right-down axes reads (0, 0, {:.1f})",
      force.x(), force.y(), force.z(), -e->log.gravity);
  if (repair.isIdentity()) {
    finding.remedy =
        "the vehicle was not upright, or its axes are turned by no right angle; state "
        "`body` in the map";
    e->Add(finding);
    return;
  }
  finding.text += fmt::format(". Which way is forward is not shown by gravity; {} is assumed",
                              AxesText(repair));
  finding.remedy = force.z() > kAlong * force.norm()
                       ? "state `body: FLU` if its x axis points forward"
                       : "state `body` as in the corrected map, and check which axis is forward";
  for (const RateWitness& witness : e->rates) e->Repair(witness.stream, {.body = repair});
  e->AddRepaired(finding, {.accel = repair, .gyro = repair});
}

// Whether the specific force, turned to earth by a stream, points along +z.
bool PointsUp(const Examination& e, const std::string& stream) {
  const Eigen::Vector3d force = ForceBy(e, stream);
  return force.norm() > 0.7 * e.log.gravity && force.z() > kAlong * force.norm();
}

std::vector<AttitudeSample> WithEarthUp(std::vector<AttitudeSample> attitude) {
  const Eigen::Quaterniond flip(0.0, 1.0, 0.0, 0.0);
  for (AttitudeSample& sample : attitude) sample.q_Ep_I = flip * sample.q_Ep_I;
  return attitude;
}

// The accelerometer with z reversed and some x and y, by changes of velocity between passes.
std::optional<TurnedForce> ReversedByPasses(const Examination& e) {
  if (e.fixed.attitude.size() < kFewest || e.fixed.fixes.empty()) return std::nullopt;
  auto reversed = BestLateralTurn(e.fixed, "fixes", -1.0);
  if (!reversed) return std::nullopt;
  FlightLog up = e.fixed;
  up.attitude = WithEarthUp(up.attitude);
  const auto heading = HeadingOf(up, "fixes", kOrdinaryGain);
  if (heading && reversed->heading.left > kMuchLess * heading->left) return std::nullopt;
  return reversed;
}

void AddReversed(Examination* e, const TurnedForce& reversed) {
  Finding finding{.level = Level::kFatal, .size = 180.0, .error = 2.0 * e->log.gravity};
  finding.text = fmt::format(
      "the accelerometer's z is reversed: attitude and gyroscope agree with each other, and with "
      "the accelerometer as {} they explain {:.0f} % of the changes of velocity of fixes.csv{}",
      AxesText(reversed.turn), 100.0 * (1.0 - reversed.heading.left),
      reversed.clear ? "" : "; the signs of x and y are not shown");
  finding.remedy = "take the accelerometer's axes so";
  AddAccelerometerAxes(e, reversed.turn, finding);
}

// Gravity points up by every attitude, and these agree with the gyroscope: either their earths have
// z up, or the accelerometer alone is turned. Positions show which. True for the accelerometer.
bool IsAccelerometerReversed(Examination* e) {
  for (const RateWitness& witness : e->rates) {
    if (!PointsUp(*e, witness.stream)) return false;
  }
  if (e->rates.empty()) return false;
  for (const char* stream : {"mocap", "pose"}) {
    const auto witness = PositionWitnessOf(*e, stream);
    if (!witness) continue;
    const auto fit = FitForce(BodyForce(e->fixed, witness->attitude), witness->bends, {});
    // CheckAccelerometer() then finds the axes.
    if (!fit) continue;
    const double up =
        ResidualOfTurnedBends(e->fixed, WithEarthUp(witness->attitude), witness->bends);
    return fit->residual < kMuchLess * up;
  }
  const auto reversed = ReversedByPasses(*e);
  if (reversed) AddReversed(e, *reversed);
  return reversed.has_value();
}

void CheckEarthUp(Examination* e, const RateWitness& witness) {
  if (!PointsUp(*e, witness.stream)) return;
  Finding finding{"earth_up", witness.stream, Level::kFatal, 180.0, "deg", 2.0 * e->log.gravity};
  finding.text = fmt::format(
      "the specific force, turned to earth axes by {}.csv, points along its +z axis ({:.1f} "
      "m/s^2): the attitude's earth has z up, where north-east-down is stated",
      witness.stream, ForceBy(*e, witness.stream).z());
  finding.remedy =
      "state `earth: NWU` (or ENU, which differs by a quarter turn of heading) for the stream";
  // Position and attitude of a pose have one earth, unless the attitude is that of another stream;
  // CheckPositions() contradicts where the accelerometer does.
  const Eigen::Matrix3d flip = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const bool of_other = e->IsCopy(witness.stream) && !IsIdentity(e->RepairOf("attitude").earth);
  StreamRepair change{.earth = flip};
  if (!of_other) change.position = flip;
  e->AddRepaired(finding, change);
}

// Degrees between up and the mean specific force in calm flight, by the repaired attitude of a
// stream; none where too little is calm.
std::optional<double> LeanBy(const Examination& e, const std::string& stream) {
  const Eigen::Vector3d force = ForceBy(e, stream);
  if (force.norm() < 0.5 * e.log.gravity) return std::nullopt;
  return LeanOf(force) / kDegree;
}

// Removes the stream's repairs: with them gravity points sideways.
void WithdrawRepairs(const std::string& stream, Examination* e) {
  if (e->result.repairs.streams.erase(stream) == 0) return;
  for (Finding& finding : e->result.findings) {
    if (finding.stream != stream || !finding.repaired) continue;
    finding.repaired = false;
    finding.text += ". The repair is withdrawn, since gravity then points sideways";
  }
}

}  // namespace

bool ReadsGravity(const FlightLog& log) { return IsOfGravity(UsualForce(log), log); }

void CheckGravity(Examination* e) {
  CheckGravityMissing(e);
  std::vector<std::pair<std::string, double>> leaning;
  bool one_agrees = false;
  for (const char* stream : {"attitude", "mocap", "pose"}) {
    const std::optional<double> lean = LeanBy(*e, stream);
    if (!lean) continue;
    if (std::cos(*lean * kDegree) < kAlong) {
      leaning.emplace_back(stream, *lean);
    } else {
      one_agrees = true;
    }
  }
  for (const auto& [stream, lean] : leaning) {
    const double error = e->log.gravity * 2.0 * std::sin(0.5 * lean * kDegree);
    Finding finding{"gravity_direction", stream, Level::kFatal, lean, "deg", error};
    finding.text = fmt::format(
        "the specific force in calm flight, turned to earth by {}.csv, points {:.0f} deg away from "
        "up{}",
        stream, lean,
        e->result.repairs.streams.empty() ? "" : ", also after the repairs that were tried");
    finding.remedy =
        "check the order of the quaternion and the axes of attitude and accelerometer in the map; "
        "inspect the original file with its map (--map), which shows the order as logged";
    WithdrawRepairs(stream, e);
    e->Add(finding);
  }
  if (!leaning.empty() && !one_agrees) WithdrawRepairs("imu", e);
}

void CheckVertical(Examination* e) {
  CheckGravityUnit(e);
  CheckBodyUp(e);
  if (IsAccelerometerReversed(e)) return;
  for (const RateWitness& witness : e->rates) CheckEarthUp(e, witness);
}

}  // namespace trueline
