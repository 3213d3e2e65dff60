#include "problems/simulation/course.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "problems/common/error.h"
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

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSpacing = 0.02;  // m between points of the table

double Cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// One corner of the polygon and the arc that rounds it.
struct Rounding {
  Vector2d in, out;  // unit vectors of the straights before and after
  double turn;       // rad, positive to the right (NED, seen from above)
  double cut;        // m of each straight that the arc takes
};

Rounding RoundingAt(const CourseConfig& config, int i) {
  const int count = static_cast<int>(config.points.size());
  const Vector2d& here = config.points[i].position;
  Rounding rounding;
  rounding.in = (here - config.points[(i + count - 1) % count].position).normalized();
  rounding.out = (config.points[(i + 1) % count].position - here).normalized();
  rounding.turn = std::atan2(Cross(rounding.in, rounding.out), rounding.in.dot(rounding.out));
  rounding.cut = config.points[i].radius * std::tan(0.5 * std::abs(rounding.turn));
  return rounding;
}

double SmoothStep(double f) { return f * f * (3.0 - 2.0 * f); }

// Points and speeds, collected while the course is traversed.
struct Walk {
  std::vector<Vector3d> points;
  std::vector<double> speeds;
  std::vector<Gate> gates;

  void Add(const Vector2d& xy, double altitude, double speed) {
    points.emplace_back(xy.x(), xy.y(), -altitude);
    speeds.push_back(speed);
  }
  void AddGate(int id, const Vector2d& xy, double altitude, const Vector2d& direction) {
    if (id < 0) return;
    gates.push_back(
        {id, Vector3d(xy.x(), xy.y(), -altitude), std::atan2(direction.y(), direction.x())});
  }
};

// The end point of each piece is left to the next piece.
void WalkLine(const Vector2d& from, const Vector2d& to, double altitude_from, double altitude_to,
              double speed, Walk* walk) {
  const double length = (to - from).norm();
  const int steps = static_cast<int>(std::ceil(length / kSpacing - 1e-9));
  for (int i = 0; i < steps; ++i) {
    const double f = static_cast<double>(i) / steps;
    walk->Add(from + f * (to - from), altitude_from + SmoothStep(f) * (altitude_to - altitude_from),
              speed);
  }
}

void WalkArc(const Vector2d& start, const Rounding& rounding, const CoursePoint& corner,
             Walk* walk) {
  const double side = rounding.turn > 0.0 ? 1.0 : -1.0;
  const Vector2d to_centre(-side * rounding.in.y(), side * rounding.in.x());
  const Vector2d centre = start + corner.radius * to_centre;
  const int steps =
      static_cast<int>(std::ceil(corner.radius * std::abs(rounding.turn) / kSpacing - 1e-9));
  for (int i = 0; i < steps; ++i) {
    const Eigen::Rotation2Dd turned(rounding.turn * i / steps);
    walk->Add(centre - corner.radius * (turned * to_centre), corner.altitude, corner.turn_speed);
  }
}

Walk WalkCorners(const CourseConfig& config) {
  Walk walk;
  const int count = static_cast<int>(config.points.size());
  for (int i = 0; i < count; ++i) {
    const CoursePoint& from = config.points[(i + count - 1) % count];
    const CoursePoint& corner = config.points[i];
    const Rounding before = RoundingAt(config, (i + count - 1) % count);
    const Rounding here = RoundingAt(config, i);
    const Vector2d start = from.position + before.cut * before.out;
    const Vector2d end = corner.position - here.cut * here.in;
    WalkLine(start, end, from.altitude, corner.altitude, corner.speed, &walk);
    walk.AddGate(corner.gate, end, corner.altitude, here.in);
    WalkArc(end, here, corner, &walk);
  }
  return walk;
}

// Second derivatives of the periodic cubic spline through `values` (n x 3) with knot distances `h`.
Eigen::MatrixXd PeriodicSpline(const Eigen::MatrixXd& values, const Eigen::VectorXd& h) {
  const int n = static_cast<int>(values.rows());
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd right(n, values.cols());
  for (int i = 0; i < n; ++i) {
    const int before = (i + n - 1) % n;
    const int after = (i + 1) % n;
    system(i, before) += h(before) / 6.0;
    system(i, i) += (h(before) + h(i)) / 3.0;
    system(i, after) += h(i) / 6.0;
    right.row(i) = (values.row(after) - values.row(i)) / h(i) -
                   (values.row(i) - values.row(before)) / h(before);
  }
  return system.partialPivLu().solve(right);
}

Walk WalkWaypoints(const CourseConfig& config) {
  const int n = static_cast<int>(config.points.size());
  Eigen::MatrixXd knots(n, 3);  // x, y, altitude
  Eigen::VectorXd h(n);
  for (int i = 0; i < n; ++i) {
    const CoursePoint& point = config.points[i];
    knots.row(i) << point.position.x(), point.position.y(), point.altitude;
  }
  for (int i = 0; i < n; ++i) h(i) = (knots.row((i + 1) % n) - knots.row(i)).norm();
  const Eigen::MatrixXd bend = PeriodicSpline(knots, h);
  Walk walk;
  for (int i = 0; i < n; ++i) {
    const int j = (i + 1) % n;
    const int steps = std::max(4, static_cast<int>(std::ceil(h(i) / kSpacing)));
    const Eigen::RowVector3d slope =
        (knots.row(j) - knots.row(i)) / h(i) - h(i) / 6.0 * (2.0 * bend.row(i) + bend.row(j));
    walk.AddGate(config.points[i].gate, config.points[i].position, config.points[i].altitude,
                 slope.head<2>());
    for (int k = 0; k < steps; ++k) {
      const double u = h(i) * k / steps;
      const Eigen::RowVector3d at = knots.row(i) + u * slope + 0.5 * u * u * bend.row(i) +
                                    u * u * u / (6.0 * h(i)) * (bend.row(j) - bend.row(i));
      walk.Add(at.head<2>(), at(2), config.points[j].speed);
    }
  }
  return walk;
}

std::string CheckCorners(const CourseConfig& config) {
  const int count = static_cast<int>(config.points.size());
  for (int i = 0; i < count; ++i) {
    const int j = (i + 1) % count;
    const Rounding here = RoundingAt(config, i);
    if (config.points[i].radius <= 0.0) return fmt::format("corner {} needs a radius > 0", i);
    if (std::abs(here.turn) < 1e-3) {
      return fmt::format("corner {} lies on the line between its neighbours; leave it out", i);
    }
    if (std::abs(here.turn) > M_PI - 1e-3) {
      return fmt::format("corner {} turns back by 180 degrees; use two corners of 90", i);
    }
    const double side = (config.points[j].position - config.points[i].position).norm();
    const double cut = here.cut + RoundingAt(config, j).cut;
    if (cut > side + 1e-9) {
      return fmt::format(
          "the arcs at corners {} and {} need {:.2f} m of a side of {:.2f} m; make the radius "
          "smaller or the side longer",
          i, j, cut, side);
    }
  }
  return "";
}

}  // namespace

std::string CheckCourse(const CourseConfig& config) {
  if (config.points.size() < 3) return "a course needs at least 3 corners or way points";
  std::set<int> gates;
  for (std::size_t i = 0; i < config.points.size(); ++i) {
    const CoursePoint& point = config.points[i];
    const CoursePoint& next = config.points[(i + 1) % config.points.size()];
    if ((next.position - point.position).norm() < 0.05) {
      return fmt::format("points {} and {} are the same", i, (i + 1) % config.points.size());
    }
    if (point.gate >= 0 && !gates.insert(point.gate).second) {
      return fmt::format("gate {} stands twice on the course; give each its own id", point.gate);
    }
  }
  return config.spline ? "" : CheckCorners(config);
}

Course BuildCourse(const CourseConfig& config) {
  const std::string error = CheckCourse(config);
  if (!error.empty()) throw InputError("course: " + error);
  const Walk walk = config.spline ? WalkWaypoints(config) : WalkCorners(config);
  return {Path(walk.points, walk.speeds, {config.along_limit, config.lateral_limit}), walk.gates};
}

}  // namespace trueline::simulation
