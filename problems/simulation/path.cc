#include "problems/simulation/path.h"

#include <algorithm>
#include <cmath>

#include "problems/simulation/rotation.h"

namespace trueline::simulation {
namespace {

constexpr double kSmoothing = 0.2;  // s, window of the acceleration's moving average

Eigen::Vector3d Lerp(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double f) {
  return a + f * (b - a);
}

}  // namespace

Path::Path(const std::vector<Eigen::Vector3d>& points, const std::vector<double>& speeds,
           const SpeedLimits& limits) {
  const int count = static_cast<int>(points.size());
  for (int i = 0; i < count; ++i) {
    s_.push_back(length_);
    PathPoint point;
    point.p_E = points[i];
    point.speed = speeds[i];
    table_.push_back(point);
    length_ += (points[(i + 1) % count] - points[i]).norm();
  }
  LimitSpeeds(limits);
  FillDerivatives();
  SmoothAccelerations(kSmoothing);
}

int Path::Wrap(int index) const {
  const int count = static_cast<int>(table_.size());
  return ((index % count) + count) % count;
}

// Lateral limit from the curvature through three points, then v^2 <= v_neighbour^2 + 2 a ds. Two
// rounds in each direction, so that the limit also holds where the path closes.
void Path::LimitSpeeds(const SpeedLimits& limits) {
  const int count = static_cast<int>(table_.size());
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d before = table_[i].p_E - table_[Wrap(i - 1)].p_E;
    const Eigen::Vector3d after = table_[Wrap(i + 1)].p_E - table_[i].p_E;
    const double curvature =
        2.0 * (after.normalized() - before.normalized()).norm() / (before.norm() + after.norm());
    if (curvature > 1e-6) {
      table_[i].speed = std::min(table_[i].speed, std::sqrt(limits.lateral / curvature));
    }
  }
  const auto limit = [&](int i, int neighbour) {
    const double ds = (table_[i].p_E - table_[neighbour].p_E).norm();
    const double v = table_[neighbour].speed;
    table_[i].speed = std::min(table_[i].speed, std::sqrt(v * v + 2.0 * limits.along * ds));
  };
  for (int i = 0; i < 2 * count; ++i) limit(Wrap(i + 1), Wrap(i));
  for (int i = 2 * count; i > 0; --i) limit(Wrap(i - 1), Wrap(i));
}

void Path::FillDerivatives() {
  const int count = static_cast<int>(table_.size());
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d chord = table_[Wrap(i + 1)].p_E - table_[Wrap(i - 1)].p_E;
    table_[i].v_E = table_[i].speed * chord.normalized();
    const double heading = std::atan2(chord.y(), chord.x());
    table_[i].heading =
        i == 0 ? heading : table_[i - 1].heading + WrapAngle(heading - table_[i - 1].heading);
  }
  for (int i = 0; i < count; ++i) {
    const PathPoint& before = table_[Wrap(i - 1)];
    const PathPoint& after = table_[Wrap(i + 1)];
    const double ds = (after.p_E - table_[i].p_E).norm() + (table_[i].p_E - before.p_E).norm();
    const double per_second = table_[i].speed / ds;
    table_[i].a_E = (after.v_E - before.v_E) * per_second;
    table_[i].heading_rate = WrapAngle(after.heading - before.heading) * per_second;
  }
}

// A moving average: a drone cannot change its acceleration instantly between straight and turn.
void Path::SmoothAccelerations(double window) {
  const std::vector<PathPoint> raw = table_;
  const int count = static_cast<int>(raw.size());
  const double ds = length_ / count;
  for (int i = 0; i < count; ++i) {
    const int reach = std::min(count / 4, static_cast<int>(0.5 * window * raw[i].speed / ds));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double rate = 0.0;
    for (int j = i - reach; j <= i + reach; ++j) {
      sum += raw[Wrap(j)].a_E;
      rate += raw[Wrap(j)].heading_rate;
    }
    table_[i].a_E = sum / (2 * reach + 1);
    table_[i].heading_rate = rate / (2 * reach + 1);
  }
}

PathPoint Path::At(double s) const {
  s -= length_ * std::floor(s / length_);
  const int i = static_cast<int>(std::upper_bound(s_.begin(), s_.end(), s) - s_.begin()) - 1;
  const PathPoint& a = table_[i];
  const PathPoint& b = table_[Wrap(i + 1)];
  const double next = i + 1 < static_cast<int>(s_.size()) ? s_[i + 1] : length_;
  const double f = (s - s_[i]) / (next - s_[i]);
  PathPoint point;
  point.p_E = Lerp(a.p_E, b.p_E, f);
  point.v_E = Lerp(a.v_E, b.v_E, f);
  point.a_E = Lerp(a.a_E, b.a_E, f);
  point.speed = a.speed + f * (b.speed - a.speed);
  point.heading = a.heading + f * WrapAngle(b.heading - a.heading);
  point.heading_rate = a.heading_rate + f * (b.heading_rate - a.heading_rate);
  return point;
}

double Path::DistanceTo(const Eigen::Vector3d& p_E, double s, double reach) const {
  const double ds = length_ / static_cast<double>(table_.size());
  double nearest = (At(s).p_E - p_E).norm();
  const int steps = static_cast<int>(reach / ds);
  for (int i = -steps; i <= steps; ++i) {
    nearest = std::min(nearest, (At(s + i * ds).p_E - p_E).norm());
  }
  return nearest;
}

}  // namespace trueline::simulation
