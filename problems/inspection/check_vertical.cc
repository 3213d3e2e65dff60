#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "problems/common/units.h"
#include "problems/inspection/examination.h"

namespace trueline {
namespace {

constexpr double kCalmRate = 0.5;   // rad/s
constexpr double kCalmForce = 1.5;  // m/s^2, from gravity
constexpr double kLeastCalm = 2.0;  // s
constexpr double kAlong = 0.85;     // cosine of a direction that is along an axis
constexpr double kLeastLean = 60.0 * kDegree;

// Mean specific force (m/s^2) in the body over the calm parts; zero where there are too few.
Eigen::Vector3d CalmForce(const FlightLog& log) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double calm = 0.0, n = 0.0;
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    const ImuSample& s = log.imu[i];
    if (s.gyro.norm() > kCalmRate || std::abs(s.accel.norm() - log.gravity) > kCalmForce) continue;
    calm += std::min(0.1, SecondsBetween(log.imu[i - 1].t, s.t));
    sum += s.accel;
    n += 1.0;
  }
  return calm < kLeastCalm ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(sum / n);
}

// The same in the earth of an attitude.
Eigen::Vector3d CalmForceInEarth(const FlightLog& log,
                                 const std::vector<AttitudeSample>& attitude) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double n = 0.0;
  std::size_t k = 0;
  for (const ImuSample& s : log.imu) {
    while (k + 1 < attitude.size() && attitude[k + 1].t <= s.t) ++k;
    if (std::abs(SecondsBetween(attitude[k].t, s.t)) > 0.3) continue;
    if (s.gyro.norm() > kCalmRate || std::abs(s.accel.norm() - log.gravity) > kCalmForce) continue;
    sum += attitude[k].q_Ep_I * s.accel;
    n += 1.0;
  }
  return n < 50.0 ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(sum / n);
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

void CheckBodyUp(Examination* e) {
  const Eigen::Vector3d force = CalmForce(e->fixed);
  if (force.norm() < 0.5 * e->log.gravity) return;
  const double lean = std::acos(std::clamp(-force.z() / force.norm(), -1.0, 1.0));
  if (lean < kLeastLean) return;
  const Eigen::Matrix3d repair = ToUpright(force);
  Finding finding;
  finding.id = "body_up";
  finding.stream = "imu";
  finding.level = Level::kFatal;
  finding.size = lean / kDegree;
  finding.unit = "deg";
  finding.error = e->log.gravity * 2.0 * std::sin(0.5 * lean);
  finding.text = fmt::format(
      "in calm flight or at rest the specific force is ({:.1f}, {:.1f}, {:.1f}) m/s^2, where a "
      "body "
      "in forward-right-down axes reads (0, 0, {:.1f})",
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
  finding.repaired = true;
  StreamRepair imu;
  imu.accel = imu.gyro = repair;
  e->Repair("imu", imu);
  StreamRepair pose;
  pose.body = repair;
  for (const RateWitness& witness : e->rates) e->Repair(witness.stream, pose);
  e->Add(finding);
}

void CheckEarthUp(Examination* e, const RateWitness& witness) {
  const Eigen::Vector3d force = CalmForceInEarth(e->fixed, AttitudesOf(e->fixed, witness.stream));
  if (force.norm() < 0.7 * e->log.gravity || force.z() < kAlong * force.norm()) return;
  Finding finding;
  finding.id = "earth_up";
  finding.stream = witness.stream;
  finding.level = Level::kFatal;
  finding.size = 180.0;
  finding.unit = "deg";
  finding.error = 2.0 * e->log.gravity;
  finding.text = fmt::format(
      "the specific force, turned to earth axes by {}.csv, points along its +z axis ({:.1f} "
      "m/s^2): "
      "the attitude's earth has z up, where north-east-down is stated",
      witness.stream, force.z());
  finding.remedy =
      "state `earth: NWU` (or ENU, which differs by a quarter turn of heading) for the stream";
  finding.repaired = true;
  StreamRepair change;
  change.earth = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  // CheckPositions() judges the positions of the same stream by the repaired attitude.
  e->Repair(witness.stream, change);
  e->Add(finding);
}

}  // namespace

void CheckVertical(Examination* e) {
  CheckBodyUp(e);
  for (const RateWitness& witness : e->rates) CheckEarthUp(e, witness);
}

}  // namespace trueline
