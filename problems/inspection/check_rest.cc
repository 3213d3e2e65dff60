#include <algorithm>
#include <cmath>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"

namespace trueline {
namespace {

constexpr double kWindow = 0.5;          // s
constexpr double kStillForce = 0.1;      // m/s^2, standard deviation of each axis
constexpr double kStillRate = 0.03;      // rad/s, of the gyroscope's standard deviation
constexpr double kLeastGyroBias = 0.02;  // rad/s

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
Rest RestOf(const FlightLog& log) {
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
    if (n >= 10.0 && end < log.imu.size() && Deviation(f, ff, n).maxCoeff() < kStillForce &&
        Deviation(w, ww, n).maxCoeff() < kStillRate && (w / n).norm() < 0.2 &&
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

}  // namespace

void CheckRest(Examination* e) {
  const Rest rest = RestOf(e->fixed);
  if (rest.seconds == 0.0) {
    e->result.notes.emplace_back(
        "gravity and the gyroscope's bias at rest: the vehicle never lies still for a second");
    return;
  }
  const double off = rest.force.norm() - e->log.gravity;
  if (std::abs(off) > kForceError) {
    const double size = rest.force.norm() / e->log.gravity;
    Finding finding{"gravity_at_rest", "imu", Level::kBiases, size, "1", std::abs(off)};
    finding.text = fmt::format(
        "at rest ({:.1f} s) the accelerometer reads {:.3f} m/s^2, {:.3f} of gravity: its scale or "
        "bias is off",
        rest.seconds, rest.force.norm(), finding.size);
    finding.remedy = "calibrate the sensor in six positions; the calibration estimates a bias";
    e->Add(finding);
  }
  if (rest.rate.norm() > kLeastGyroBias) {
    Finding finding{"gyro_bias_at_rest", "imu", Level::kWidens, rest.rate.norm(), "rad/s"};
    finding.text =
        fmt::format("at rest ({:.1f} s) the gyroscope reads ({:.4f}, {:.4f}, {:.4f}) rad/s",
                    rest.seconds, rest.rate.x(), rest.rate.y(), rest.rate.z());
    finding.remedy =
        "subtract it (gyro: offset in the map, in the file's own axes: for body: FLU with the "
        "signs of y and z changed), or let the vehicle rest at the start";
    e->Add(finding);
  }
}

}  // namespace trueline
