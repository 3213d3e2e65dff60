#include "problems/diagnosis/imu_terms.h"

#include <cmath>
#include <functional>

#include "problems/diagnosis/chain_stacks.h"
#include "problems/log/fixes.h"

namespace trueline {
namespace {

using Eigen::Vector3d;

// At the middle of a segment.
struct SegmentMotion : TermMotion {
  double gravity = 0.0;  // m/s^2
  double turn = 0.0;     // rad/s, of the heading

  Vector3d SpecificForce() const { return -(thrust + gravity) * R_E_B.col(2); }  // m/s^2, in E
};

using Force = std::function<Vector3d(const SegmentMotion&)>;  // m/s^2, in E

Force InBody(const std::function<Vector3d(const SegmentMotion&)>& f_B) {
  return [f_B](const SegmentMotion& at) -> Vector3d { return at.R_E_B * f_B(at); };
}

// Derivative of the thrust's horizontal part by an error of the heading, per rad.
Vector3d Turned(const SegmentMotion& at, double angle) {
  const Vector3d thrust_E = at.SpecificForce();
  return angle * Vector3d(-thrust_E.y(), thrust_E.x(), 0.0);
}

struct ForceTerm {
  std::string name;
  std::vector<Force> forces;  // tested jointly
};

std::vector<ForceTerm> ForceTerms() {
  const auto x = [](double value) { return Vector3d(value, 0.0, 0.0); };
  const auto y = [](double value) { return Vector3d(0.0, value, 0.0); };
  return {
      {"sideways speed, across axes",
       {InBody([=](const SegmentMotion& a) { return x(a.v_B.y()); }),
        InBody([=](const SegmentMotion& a) { return y(a.v_B.x()); })}},
      {"climb rate",
       {InBody([=](const SegmentMotion& a) { return x(a.v_B.z()); }),
        InBody([=](const SegmentMotion& a) { return y(a.v_B.z()); })}},
      {"turn rate",
       {InBody([=](const SegmentMotion& a) { return x(a.turn); }),
        InBody([=](const SegmentMotion& a) { return y(a.turn); })}},
      {"turn rate and speed",
       {InBody([=](const SegmentMotion& a) { return x(a.turn * a.v_B.norm()); }),
        InBody([=](const SegmentMotion& a) { return y(a.turn * a.v_B.norm()); })}},
      {"thrust",
       {InBody([=](const SegmentMotion& a) { return x(a.thrust); }),
        InBody([=](const SegmentMotion& a) { return y(a.thrust); })}},
      {"cube of speed", {InBody([=](const SegmentMotion& a) {
         return Vector3d(a.v_B.squaredNorm() * Vector3d(a.v_B.x(), a.v_B.y(), 0.0));
       })}},
      {"heading",
       {[=](const SegmentMotion& a) { return x(std::cos(2 * a.Heading())); },
        [=](const SegmentMotion& a) { return x(std::sin(2 * a.Heading())); },
        [=](const SegmentMotion& a) { return y(std::cos(2 * a.Heading())); },
        [=](const SegmentMotion& a) { return y(std::sin(2 * a.Heading())); }}},
      {"an error of heading with two periods a turn",
       {[=](const SegmentMotion& a) { return Turned(a, std::sin(2 * a.Heading())); },
        [=](const SegmentMotion& a) { return Turned(a, std::cos(2 * a.Heading())); }}},
      {"place, north to south",
       {[=](const SegmentMotion& a) { return x(a.p_E.x()); },
        [=](const SegmentMotion& a) { return y(a.p_E.x()); }}},
      {"place, east to west",
       {[=](const SegmentMotion& a) { return x(a.p_E.y()); },
        [=](const SegmentMotion& a) { return y(a.p_E.y()); }}},
      {"time, with a force from one side",
       {[=](const SegmentMotion& a) { return x(a.s); },
        [=](const SegmentMotion& a) { return y(a.s); }}},
  };
}

std::vector<SegmentMotion> MotionsOf(const BaseFlight& flight, const FlightUnknowns& x) {
  const auto& segments = flight.plan().segments;
  const double duration = SecondsBetween(segments.front().begin, segments.back().end);
  std::vector<SegmentMotion> motions;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const TimeNs middle = (segments[i].begin + segments[i].end) / 2;
    const Drive& drive = flight.track().steps()[flight.track().StepAt(middle)].drive;
    SegmentMotion at;
    at.R_E_B = drive.R_Ep_I;
    at.v_B = at.R_E_B.transpose() * x.nodes[i].segment<3>(kStateAt + 3);
    at.p_E = x.nodes[i].segment<3>(kStateAt);
    at.gravity = flight.gravity();
    at.thrust = -drive.a_z - at.gravity;
    if (!StartsStretch(flight.plan(), static_cast<int>(i))) {
      const TimeNs before = (segments[i - 1].begin + segments[i - 1].end) / 2;
      at.turn = std::remainder(at.Heading() - motions.back().Heading(), 2 * M_PI) /
                SecondsBetween(before, middle);
    }
    at.s = 2.0 * SecondsBetween(segments.front().begin, middle) / duration - 1.0;
    motions.push_back(at);
  }
  return motions;
}

// A constant acceleration over each segment, as a column over all rows.
Eigen::VectorXd ForceColumn(const BaseFlight& flight, const std::vector<SegmentMotion>& motions,
                            const Force& force) {
  const FlightPlan& plan = flight.plan();
  Eigen::VectorXd column = Eigen::VectorXd::Zero(flight.rows());
  std::vector<Vector3d> a_E;
  for (const SegmentMotion& at : motions) {
    a_E.push_back(force(at));
    a_E.back().z() = 0.0;  // the accelerometer measures it along the thrust axis
  }
  for (std::size_t i = 0; i < plan.fixes.size(); ++i) {
    const TimeNs t = flight.log().fixes[plan.fixes[i]].t;
    const int s = plan.SegmentOf(t);
    const double dt = SecondsBetween(plan.segments[s].begin, t);
    column.segment<3>(3 * static_cast<Eigen::Index>(i)) = a_E[s] * (0.5 * dt * dt);
  }
  const int forces_at = static_cast<int>(3 * plan.fixes.size());
  for (std::size_t i = 0; i < plan.forces.size(); ++i) {
    const TimeNs t = flight.forces()[plan.forces[i]].t;
    const int s = plan.SegmentOf(t);
    const Vector3d f_I =
        flight.track().steps()[flight.track().StepAt(t)].drive.R_Ep_I.transpose() * a_E[s];
    column.segment<2>(forces_at + 2 * static_cast<int>(i)) = f_I.head<2>();
  }
  for (std::size_t s = 0; s < plan.segments.size(); ++s) {
    if (!plan.segments[s].linked) continue;
    const double h = SecondsBetween(plan.segments[s].begin, plan.segments[s].end);
    const int row = flight.LinkRow(static_cast<int>(s));
    column.segment<3>(row) = -a_E[s] * (0.5 * h * h);
    column.segment<3>(row + 3) = -a_E[s] * h;
  }
  return column;
}

// Sizes that are not reported: an acceleration of 0.01 m/s^2 (RMS over the flight, by the rows of
// forces, or links if there are none).
Eigen::VectorXd OrdinarySizes(const Eigen::MatrixXd& columns, const BaseFlight& flight) {
  constexpr double kOfNoInterest = 0.01;  // m/s^2
  const int forces_at = static_cast<int>(3 * flight.plan().fixes.size());
  const int samples = static_cast<int>(flight.plan().forces.size());
  const int links = static_cast<int>(flight.plan().segments.size());
  Eigen::VectorXd sizes(columns.cols());
  for (int i = 0; i < columns.cols(); ++i) {
    const auto column = columns.col(i);
    const double h = SecondsBetween(flight.plan().segments[0].begin, flight.plan().segments[0].end);
    const double rms = samples > 0
                           ? column.segment(forces_at, 2 * samples).norm() / std::sqrt(samples)
                           : column.tail(6 * links).norm() / (h * std::sqrt(links));
    sizes[i] = kOfNoInterest / std::max(rms, 1e-9);
  }
  return sizes;
}

// Errors of gates' fixes (m, E) by the vector to the gate and time.
std::vector<ImuTerm> FixTerms(const BaseFlight& flight) {
  const FlightPlan& plan = flight.plan();
  ImuTerm square{"square of the distance to the gate", Eigen::MatrixXd::Zero(flight.rows(), 1), {}};
  ImuTerm map{"time, as a map that drifts", Eigen::MatrixXd::Zero(flight.rows(), 2), {}};
  const auto& log = flight.log();
  const double duration = SecondsBetween(log.imu.front().t, log.imu.back().t);
  for (std::size_t i = 0; i < plan.fixes.size(); ++i) {
    const Fix& fix = log.fixes[plan.fixes[i]];
    const int row = 3 * static_cast<int>(i);
    const double s = 2.0 * SecondsBetween(log.imu.front().t, fix.t) / duration - 1.0;
    map.columns(row, 0) = map.columns(row + 1, 1) = -s;
    const Gate* gate = GateOf(log, fix.gate);
    if (gate == nullptr) continue;
    const Vector3d u_E = gate->position - flight.StateAtFix(i).head<3>();
    square.columns.col(0).segment<3>(row) = u_E * u_E.norm();
  }
  std::vector<ImuTerm> terms{map};
  if (!square.columns.isZero(0.0)) terms.push_back(square);
  terms[0].ordinary.setConstant(2, 0.03);                        // m
  if (terms.size() > 1) terms[1].ordinary.setConstant(1, 0.01);  // 1/m
  return terms;
}

}  // namespace

std::vector<ImuTerm> ImuTerms(BaseFlight* flight, const FlightUnknowns& x) {
  flight->Evaluate(x, false);
  const std::vector<SegmentMotion> motions = MotionsOf(*flight, x);
  std::vector<ImuTerm> terms = FixTerms(*flight);
  for (const ForceTerm& term : ForceTerms()) {
    Eigen::MatrixXd columns(flight->rows(), term.forces.size());
    for (std::size_t i = 0; i < term.forces.size(); ++i) {
      columns.col(static_cast<int>(i)) = ForceColumn(*flight, motions, term.forces[i]);
    }
    terms.push_back({term.name, columns, OrdinarySizes(columns, *flight)});
  }
  return terms;
}

}  // namespace trueline
