#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "cost_functions/models/imu_driven_model.h"
#include "problems/log/samples.h"
#include "problems/observability/flight_from_log.h"

namespace trueline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPathStep = 0.01;  // s
// m/s^2, of the acceleration's error (tilt, biases): the one that explains the positions best is
// taken.
constexpr double kForceSigmas[] = {0.03, 0.1, 0.3, 1.0, 3.0};
constexpr double kUsualForceSigma = 0.3;
constexpr double kForceMemory = 10.0;    // s, over which that error lasts
constexpr double kWhiteShare = 0.1;      // of that error in m/s^2: its white part in m/s^2/sqrt(Hz)
constexpr double kUnknownSpeed = 10.0;   // m/s, sigma before the first position
constexpr double kUnknownPlace = 100.0;  // m
constexpr double kFarMiss = 16.0;  // squared distance in sigmas beyond which a position is noisier

// Position, velocity and the acceleration's error in rows, an axis of E in each column. The axes
// share one covariance.
struct PathEstimate {
  Matrix3d mean = Matrix3d::Zero();
  Matrix3d cov = Matrix3d::Zero();
};

// What is known of a step: its specific force in E', and positions within half a step of its start.
struct PathCell {
  double t = 0.0;  // s, of its start
  Vector3d force_Ep = Vector3d::Zero();
  std::vector<PositionReading> positions;
};

std::size_t CellOf(TimeNs t, double start, std::size_t cells) {
  const double index = std::round((ToSeconds(t) - start) / kPathStep);
  return static_cast<std::size_t>(std::clamp(index, 0.0, static_cast<double>(cells - 1)));
}

// A step without an IMU sample takes the force of the one before; steps before the first attitude
// are at rest.
void AddForces(const std::vector<ImuSample>& imu, const std::vector<AttitudeSample>& attitude,
               double start, double gravity, std::vector<PathCell>* cells) {
  constexpr double kAnyGap = 1e9;  // s
  AttitudeCursor cursor(attitude);
  std::vector<int> counts(cells->size(), 0);
  for (const ImuSample& sample : imu) {
    Eigen::Quaterniond q;
    if (!cursor.At(sample.t, kAnyGap, &q)) continue;
    const std::size_t i = CellOf(sample.t, start, cells->size());
    (*cells)[i].force_Ep += (q.normalized() * sample.accel - (*cells)[i].force_Ep) / ++counts[i];
  }
  for (std::size_t i = 0; i < cells->size(); ++i) {
    if (counts[i] > 0) continue;
    (*cells)[i].force_Ep = i > 0 ? (*cells)[i - 1].force_Ep : Vector3d(0.0, 0.0, -gravity);
  }
}

Matrix3d StepMatrix() {
  Matrix3d F = Matrix3d::Identity();
  F(0, 1) = F(1, 2) = kPathStep;
  F(0, 2) = 0.5 * kPathStep * kPathStep;
  F(2, 2) = std::exp(-kPathStep / kForceMemory);
  return F;
}

class PathFilter {
 public:
  PathFilter(const std::vector<PathCell>& cells, double gravity, double force_sigma)
      : cells_(cells), g_E_(0.0, 0.0, gravity), force_sigma_(force_sigma), F_(StepMatrix()) {
    Q_(1, 1) = std::pow(kWhiteShare * force_sigma, 2) * kPathStep;
    Q_(2, 2) = force_sigma * force_sigma * (1.0 - F_(2, 2) * F_(2, 2));
  }

  // Minus twice the log-likelihood of the positions, but for a constant.
  double Cost(double heading) const {
    return Run(heading, [](const PathEstimate&, const PathEstimate&) {});
  }

  // Runs forward. `visit(predicted, updated)` is called at each step. Returns the cost.
  template <class Visitor>
  double Run(double heading, const Visitor& visit) const {
    const Matrix3d R_E_Ep = RotationFromEuler<double>({0.0, 0.0, heading}).transpose();
    PathEstimate now;
    now.cov.diagonal() << kUnknownPlace * kUnknownPlace, kUnknownSpeed * kUnknownSpeed,
        force_sigma_ * force_sigma_;
    double cost = 0.0;
    for (const PathCell& cell : cells_) {
      const PathEstimate predicted = now;
      for (const PositionReading& position : cell.positions) {
        cost += Update(position, ToSeconds(position.t) - cell.t, &now);
      }
      visit(predicted, now);
      now = Next(now, R_E_Ep * cell.force_Ep + g_E_);
    }
    return cost;
  }

  // Means of the whole flight; `variance` is of the velocity.
  std::vector<Vector3d> Velocities(double heading, double* variance) const {
    std::vector<PathEstimate> predicted, updated;
    Run(heading, [&](const PathEstimate& before, const PathEstimate& after) {
      predicted.push_back(before), updated.push_back(after);
    });
    std::vector<Vector3d> velocities(updated.size());
    PathEstimate later = updated.back();
    *variance = 0.0;
    for (std::size_t k = updated.size(); k-- > 0;) {
      if (k + 1 < updated.size()) later = Smoothed(updated[k], predicted[k + 1], later);
      velocities[k] = later.mean.row(1);
      *variance += later.cov(1, 1) / static_cast<double>(updated.size());
    }
    return velocities;
  }

 private:
  PathEstimate Next(const PathEstimate& now, const Vector3d& a_E) const {
    PathEstimate next{F_ * now.mean, F_ * now.cov * F_.transpose() + Q_};
    next.mean.row(0) += 0.5 * kPathStep * kPathStep * a_E.transpose();
    next.mean.row(1) += kPathStep * a_E.transpose();
    return next;
  }
  // A position taken `later` (s) than the step's start.
  static double Update(const PositionReading& position, double later, PathEstimate* now) {
    const Vector3d seen(1.0, later, 0.0);
    const Vector3d miss = position.p_E - now->mean.transpose() * seen;
    const Vector3d shared = now->cov * seen;
    double variance = seen.dot(shared) + position.sigma * position.sigma;
    variance = std::max(variance, miss.squaredNorm() / kFarMiss);
    const Vector3d gain = shared / variance;
    now->mean += gain * miss.transpose();
    now->cov -= gain * gain.transpose() * variance;
    return miss.squaredNorm() / variance + 3.0 * std::log(variance);
  }
  PathEstimate Smoothed(const PathEstimate& now, const PathEstimate& predicted,
                        const PathEstimate& later) const {
    const Matrix3d gain = now.cov * F_.transpose() * predicted.cov.inverse();
    return {now.mean + gain * (later.mean - predicted.mean),
            now.cov + gain * (later.cov - predicted.cov) * gain.transpose()};
  }

  const std::vector<PathCell>& cells_;
  Vector3d g_E_;
  double force_sigma_;  // m/s^2
  Matrix3d F_, Q_ = Matrix3d::Zero();
};

// The heading with which the accelerometer explains the positions best; 0 unless another one is
// clearly better.
double BestHeading(const PathFilter& filter) {
  constexpr double kClearly = 20.0;
  const double as_stated = filter.Cost(0.0);
  double best = 0.0, least = as_stated;
  const auto look = [&](double heading) {
    const double at = filter.Cost(heading);
    if (at < least) least = at, best = heading;
  };
  constexpr int kRefinements = 6;  // to 0.001 rad
  double width = M_PI;
  for (int k = 0; k < kRefinements; ++k) {
    const double centre = best;
    for (int i = -4; i <= 4; ++i) {
      if (i != 0) look(centre + 0.25 * i * width);
    }
    width *= 0.25;
  }
  return as_stated - least > kClearly ? std::remainder(best, 2.0 * M_PI) : 0.0;
}

double BestForceSigma(const std::vector<PathCell>& cells, double gravity, double heading) {
  double best = kUsualForceSigma, least = INFINITY;
  for (const double sigma : kForceSigmas) {
    const double cost = PathFilter(cells, gravity, sigma).Cost(heading);
    if (cost < least) least = cost, best = sigma;
  }
  return best;
}

}  // namespace

Vector3d SmoothedPath::VelocityAt(double t) const {
  const double index = std::clamp((t - start) / step, 0.0, static_cast<double>(v_E.size() - 1));
  const auto before = static_cast<std::size_t>(index);
  const std::size_t after = std::min(before + 1, v_E.size() - 1);
  return v_E[before] + (index - std::floor(index)) * (v_E[after] - v_E[before]);
}

SmoothedPath SmoothPath(const std::vector<ImuSample>& imu,
                        const std::vector<AttitudeSample>& attitude,
                        const std::vector<PositionReading>& positions, double gravity) {
  SmoothedPath path;
  path.start = ToSeconds(imu.front().t);
  path.step = kPathStep;
  const double length = SecondsBetween(imu.front().t, imu.back().t);
  std::vector<PathCell> cells(static_cast<std::size_t>(length / kPathStep) + 2);
  AddForces(imu, attitude, path.start, gravity, &cells);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i].t = path.start + kPathStep * static_cast<double>(i);
  }
  for (const PositionReading& position : positions) {
    if (position.t < imu.front().t || position.t > imu.back().t) continue;
    cells[CellOf(position.t, path.start, cells.size())].positions.push_back(position);
  }
  path.heading = BestHeading(PathFilter(cells, gravity, kUsualForceSigma));
  const PathFilter filter(cells, gravity, BestForceSigma(cells, gravity, path.heading));
  double variance = 0.0;
  path.v_E = filter.Velocities(path.heading, &variance);
  path.sigma = std::sqrt(variance);
  return path;
}

}  // namespace trueline
