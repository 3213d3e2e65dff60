#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/inspection/force_fit.h"
#include "problems/inspection/heading.h"
#include "problems/inspection/position_witness.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kLeastCalm = 2.0;  // s

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
    if (s.gyro.norm() > kGyroscope.calm ||
        std::abs(s.accel.norm() - log.gravity) > kAccelerometer.calm)
      continue;
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
  e->Add({&fault::kGravityMissing, "imu", Level::kFatal, usual, e->log.gravity},
         fmt::format("the accelerometer reads {:.2f} m/s^2 (median of its size), where a vehicle "
                     "in flight reads "
                     "about {:.1f}: gravity is taken out, or it is in another unit",
                     usual, e->log.gravity),
         "log the specific force, with gravity, or check the unit; without one calibrate "
         "with --thrust=level_flight");
}

// The rotation among the signed permutations that takes `force` nearest to -z by the least angle.
Eigen::Matrix3d ToUpright(const Eigen::Vector3d& force) {
  Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& m : SignedPermutations()) {
    if (m.determinant() < 0.0 || -(m * force).z() < kSound * force.norm()) continue;
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
  return -up.z() > kSound * static_cast<double>(attitude.size());
}

void CheckBodyUp(Examination* e) {
  const Eigen::Vector3d force = CalmForce(e->fixed, nullptr);
  if (force.norm() < 0.5 * e->log.gravity) return;
  if (-force.z() > kMajority * force.norm()) return;
  // Then the accelerometer alone is turned, which CheckAccelerometer() or CheckGravity() says.
  if (IsUprightByAttitude(*e)) return;
  const Eigen::Matrix3d repair = ToUpright(force);
  const double lean = LeanOf(force);
  Finding finding{&fault::kBodyUp, "imu", Level::kFatal, lean / kDegree, ErrorOfTurn(*e, lean)};
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
  finding.remedy = force.z() > kSound * force.norm()
                       ? "state `body: FLU` if its x axis points forward"
                       : "state `body` as in the corrected map, and check which axis is forward";
  for (const RateWitness& witness : e->rates) e->Repair(witness.stream, {.body = repair});
  e->AddRepaired(finding, {.accel = repair, .gyro = repair});
}

// Whether the specific force, turned to earth by a stream, points along +z.
bool PointsUp(const Examination& e, const std::string& stream) {
  const Eigen::Vector3d force = ForceBy(e, stream);
  return force.norm() > 0.7 * e.log.gravity && force.z() > kSound * force.norm();
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
  if (heading && reversed->heading.left > kExplains * heading->left) return std::nullopt;
  return reversed;
}

void AddReversed(Examination* e, const TurnedForce& reversed) {
  AddAccelerometerAxes(
      e, reversed.turn, ErrorOfTurn(*e, M_PI),
      fmt::format(
          "the accelerometer's z is reversed: attitude and gyroscope agree with each other, "
          "and with the accelerometer as {} they explain {:.0f} % of the changes of velocity "
          "of fixes.csv{}",
          AxesText(reversed.turn), 100.0 * (1.0 - reversed.heading.left),
          reversed.clear ? "" : "; the signs of x and y are not shown"));
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
    return fit->residual < kExplains * up;
  }
  const auto reversed = ReversedByPasses(*e);
  if (reversed) AddReversed(e, *reversed);
  return reversed.has_value();
}

void CheckEarthUp(Examination* e, const RateWitness& witness) {
  if (!PointsUp(*e, witness.stream)) return;
  // Position and attitude of a pose have one earth, unless the attitude is that of another stream;
  // CheckPositions() contradicts where the accelerometer does.
  const Eigen::Matrix3d flip = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const bool of_other = e->IsCopy(witness.stream) && !IsIdentity(e->RepairOf("attitude").earth);
  StreamRepair change{.earth = flip};
  if (!of_other) change.position = flip;
  e->AddRepaired(
      {&fault::kEarthUp, witness.stream, Level::kFatal, 180.0, ErrorOfTurn(*e, M_PI)},
      fmt::format("the specific force, turned to earth axes by {}.csv, points along its +z axis "
                  "({:.1f} m/s^2): the attitude's earth has z up, where north-east-down is stated",
                  witness.stream, ForceBy(*e, witness.stream).z()),
      "state `earth: NWU` (or ENU, which differs by a quarter turn of heading) for the stream",
      change);
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

constexpr double kWindow = 0.5;  // s

struct Rest {
  double seconds = 0.0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), rate = Eigen::Vector3d::Zero();  // means
};

Eigen::Vector3d Deviation(const Eigen::Vector3d& sum, const Eigen::Vector3d& squares, double n) {
  const Eigen::Vector3d mean = sum / n;
  return (squares / n - mean.cwiseProduct(mean)).cwiseMax(0.0).cwiseSqrt();
}

// Positions of the stream that knows them best.
std::vector<PositionSample> PositionsOf(const FlightLog& log, double* sigma) {
  *sigma = 0.0;
  if (!log.mocap.empty()) return PositionsOf(log.mocap);
  if (!log.pose.empty()) return PositionsOf(log.pose);
  for (const Fix& fix : log.fixes) *sigma = std::max(*sigma, fix.sigma);
  return PositionsOf(log.fixes);
}

// Whether positions around the time from `from` to `until` lie farther apart than at rest.
bool Moves(const std::vector<PositionSample>& positions, double sigma, TimeNs from, TimeNs until) {
  constexpr double kSpeed = 0.3;  // m/s
  const auto earlier = [](const PositionSample& a, TimeNs t) { return a.t < t; };
  auto after = std::lower_bound(positions.begin(), positions.end(), until, earlier);
  auto before = std::lower_bound(positions.begin(), positions.end(), from, earlier);
  if (before != positions.begin()) --before;
  if (before == positions.end() || after == positions.end()) return false;
  const double seconds = SecondsBetween(before->t, after->t);
  return (after->p_E - before->p_E).norm() > kSpeed * seconds + 4.0 * sigma;
}

// All windows in which nothing but noise is read, and no position changes. Smooth flight reads
// like rest for a moment, so that a rest has two windows in a row.
Rest FindRest(const FlightLog& log) {
  Rest rest;
  double windows = 0.0, sigma = 0.0;
  const std::vector<PositionSample> positions = PositionsOf(log, &sigma);
  Rest last;  // of the window before, not yet counted
  const auto add = [&](const Rest& window) {
    rest.seconds += kWindow;
    rest.force += window.force;
    rest.rate += window.rate;
    windows += 1.0;
  };
  bool was_still = false, was_added = false;
  for (std::size_t begin = 0; begin < log.imu.size();) {
    std::size_t end = begin;
    Eigen::Vector3d f = Eigen::Vector3d::Zero(), ff = f, w = f, ww = f;
    while (end < log.imu.size() && SecondsBetween(log.imu[begin].t, log.imu[end].t) < kWindow) {
      const ImuSample& s = log.imu[end++];
      f += s.accel;
      ff += s.accel.cwiseProduct(s.accel);
      w += s.gyro;
      ww += s.gyro.cwiseProduct(s.gyro);
    }
    const auto n = static_cast<double>(end - begin);
    if (n >= 10.0 && end < log.imu.size() &&
        Deviation(f, ff, n).maxCoeff() < kAccelerometer.still &&
        Deviation(w, ww, n).maxCoeff() < kGyroscope.still && (w / n).norm() < 0.2 &&
        !Moves(positions, sigma, log.imu[begin].t, log.imu[end].t)) {
      const Rest window{kWindow, f / n, w / n};
      if (was_still && !was_added) add(last);
      if (was_still) add(window);
      was_added = was_still;
      was_still = true;
      last = window;
    } else {
      was_still = was_added = false;
    }
    begin = end;
  }
  if (windows > 0.0) {
    rest.force /= windows;
    rest.rate /= windows;
  }
  return rest;
}

// What the accelerometer's numbers may be. Gravity that was taken out points along +z of the
// attitude's earth (1), or along -z where that has z up (-1).
struct Meaning {
  bool in_earth;
  double gravity_removed, scale;
};

// The first is as read. Numbers without gravity do not show their unit by their mean.
std::vector<Meaning> AllMeanings() {
  std::vector<Meaning> all = {{false, 0.0, 1.0}, {true, 0.0, 1.0}};
  for (const bool in_earth : {false, true}) {
    for (const double sign : {1.0, -1.0}) {
      for (const double scale : {1.0, kStandardGravity, 1.0 / kStandardGravity}) {
        all.push_back({in_earth, sign, scale});
      }
    }
  }
  return all;
}

// Thrust points along the body's z, so that only the right meaning leaves little across. m/s^2,
// rms, of each; none for one that the mean of the numbers contradicts.
std::vector<std::optional<double>> ForcesAcross(const Examination& e, const std::string& by,
                                                const std::vector<Meaning>& all) {
  const std::vector<AttitudeSample> attitude = AttitudesOf(e.fixed, by);
  const Eigen::Matrix3d to_earth = EarthFromBodyAsRead(e.sources, by);
  AttitudeCursor cursor(attitude);
  std::vector<double> squares(all.size(), 0.0);
  std::array<Eigen::Vector3d, 2> sums = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double square = 0.0, n = 0.0;
  for (const ImuSample& sample : e.fixed.imu) {
    Eigen::Quaterniond q;
    if (!cursor.At(sample.t, kAttitudeGap, &q)) continue;
    const Eigen::Vector3d down = e.log.gravity * (q.conjugate() * Eigen::Vector3d::UnitZ()),
                          turned = q.conjugate() * to_earth * sample.accel;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Eigen::Vector3d& read = all[i].in_earth ? turned : sample.accel;
      squares[i] += (all[i].scale * read - all[i].gravity_removed * down).head<2>().squaredNorm();
    }
    sums[0] += q * sample.accel;
    sums[1] += sample.accel;
    square += sample.accel.squaredNorm();
    n += 1.0;
  }
  std::vector<std::optional<double>> across(all.size());
  // Turned by hand it feels gravity alone, the same in earth as read, and across its z.
  const bool flies =
      n > 0.0 && square / n - (sums[0] / n).squaredNorm() > kExplains * squares[0] / n;
  for (std::size_t i = 0; i < all.size() && n > 0.0; ++i) {
    const double mean = sums[all[i].in_earth ? 1 : 0].norm() / n;
    const bool removed = mean < kLittle * std::sqrt(square / n);
    const bool may_be = flies && removed == (all[i].gravity_removed != 0.0);
    if (i == 0 || may_be) across[i] = std::sqrt(squares[i] / n);
  }
  return across;
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
    if (std::cos(*lean * kDegree) < kSound) {
      leaning.emplace_back(stream, *lean);
    } else {
      one_agrees = true;
    }
  }
  for (const auto& [stream, lean] : leaning) {
    const bool repaired = !e->result.repairs.streams.empty();
    WithdrawRepairs(stream, e);
    e->Add(
        {&fault::kGravityDirection, stream, Level::kFatal, lean, ErrorOfTurn(*e, lean * kDegree)},
        fmt::format("the specific force in calm flight, turned to earth by {}.csv, points {:.0f} "
                    "deg away from up{}",
                    stream, lean, repaired ? ", also after the repairs that were tried" : ""),
        "check the order of the quaternion and the axes of attitude and accelerometer in the "
        "map; inspect the original file with its map (--map), which shows the order as logged");
  }
  if (!leaning.empty() && !one_agrees) WithdrawRepairs("imu", e);
}

void CheckVertical(Examination* e) {
  CheckGravityUnit(e);
  CheckBodyUp(e);
  if (IsAccelerometerReversed(e)) return;
  for (const RateWitness& witness : e->rates) CheckEarthUp(e, witness);
}

void CheckRest(Examination* e) {
  const Rest rest = FindRest(e->fixed);
  if (rest.seconds == 0.0) {
    e->result.notes.emplace_back(
        "gravity and the gyroscope's bias at rest: the vehicle never lies still for a second");
    return;
  }
  const double off = rest.force.norm() - e->log.gravity;
  if (std::abs(off) > kForceError) {
    const double size = rest.force.norm() / e->log.gravity;
    const Finding finding{&fault::kGravityAtRest, "imu", Level::kBiases, size, std::abs(off)};
    e->Add(finding,
           fmt::format("at rest ({:.1f} s) the accelerometer reads {:.3f} m/s^2, {:.3f} of "
                       "gravity: its scale or "
                       "bias is off",
                       rest.seconds, rest.force.norm(), finding.size),
           "calibrate the sensor in six positions; the calibration estimates a bias");
  }
  if (rest.rate.norm() > kGyroscope.still) {
    e->Add({&fault::kGyroBiasAtRest, "imu", Level::kWidens, rest.rate.norm()},
           fmt::format("at rest ({:.1f} s) the gyroscope reads ({:.4f}, {:.4f}, {:.4f}) rad/s",
                       rest.seconds, rest.rate.x(), rest.rate.y(), rest.rate.z()),
           "subtract it (gyro: offset in the map, in the file's own axes: for body: FLU with the "
           "signs of y and z changed), or let the vehicle rest at the start");
  }
}

void CheckForce(Examination* e) {
  if (e->rates.empty()) return;
  const std::string& by = e->rates.front().stream;
  const std::vector<Meaning> all = AllMeanings();
  const auto across = ForcesAcross(*e, by, all);
  std::size_t best = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (across[i] && across[best] && *across[i] < *across[best]) best = i;
  }
  if (best == 0 || *across[best] > kExplains * *across[0] ||
      *across[0] - *across[best] < kOtherScale * e->log.gravity) {
    return;
  }
  const Meaning& meaning = all[best];
  Finding finding{&fault::kNotSpecificForce, "imu", Level::kFatal, *across[0], *across[0]};
  finding.text = fmt::format(
      "the accelerometer's numbers are{}{}: so read, {:.2f} m/s^2 (rms) of the force are across "
      "the thrust, as read {:.2f}",
      meaning.in_earth ? " in the earth's axes" : "",
      meaning.gravity_removed == 0.0 ? ""
      : meaning.in_earth             ? " and without gravity"
                                     : " without gravity",
      *across[best], *across[0]);
  finding.remedy =
      "log the specific force in the body's axes, or state the `attitude` beside the columns of "
      "`accel` (and `gravity: removed`, `axes: body`)";
  const auto source = e->sources.find(by);
  if (source == e->sources.end() || !source->second.is_beside_imu) return e->Add(finding);
  e->AddRepaired(finding, {.accel_scale = meaning.scale,
                           .force_by = by,
                           .force_in_earth = meaning.in_earth,
                           .gravity_removed = meaning.gravity_removed});
}

}  // namespace trueline
