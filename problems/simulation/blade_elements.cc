#include "problems/simulation/blade_elements.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "problems/common/error.h"

namespace trueline::simulation {
namespace {

using Vector4 = Eigen::Vector4d;

constexpr int kSpan = 8, kAround = 16;
constexpr double kRoot = 0.15;      // of the radius, where the blade begins
constexpr double kMostPitch = 0.7;  // rad

}  // namespace

// What the disc meets. Axes: where the hub moves to, across that, and along the rotor's axis.
// Azimuths count from the first to the second axis.
struct BladeRotor::Wind {
  double speed;        // rad/s
  double across;       // m/s, of the hub in the disc's plane
  double climb;        // m/s, of the hub along the axis
  double roll, pitch;  // rad/s, of the hub about the two axes in the disc's plane
};

// Of the air and the blades.
struct BladeRotor::Response {
  double skew = 0.0;                 // of the induced flow: more of it at the rear
  Vector4 values = Vector4::Zero();  // m/s induced; rad of flapping: mean, cosine, sine
};

namespace {

struct Element {
  double r, share;      // m; of the radius
  double cosine, sine;  // of the azimuth
  double area;          // rho c dr / 2, averaged over a turn, kg/m^2
  double along;         // m/s, air speed along the blade's own motion
  double through;       // m/s, down through the disc, by the motion of the hub
};

}  // namespace

template <class Visit>
void BladeRotor::ForEachElement(const Wind& wind, const Visit& visit) const {
  const double dr = blades_.radius * (1.0 - kRoot) / kSpan;
  for (int a = 0; a < kAround; ++a) {
    const double angle = 2.0 * M_PI * (a + 0.5) / kAround;
    const double cosine = std::cos(angle), sine = std::sin(angle);
    for (int k = 0; k < kSpan; ++k) {
      Element e{};
      e.r = blades_.radius * kRoot + (k + 0.5) * dr;
      e.share = e.r / blades_.radius;
      e.cosine = cosine, e.sine = sine;
      e.area = 0.5 * blades_.air_density * blades_.chord * dr / kAround;
      e.along = wind.speed * e.r - turns_ * wind.across * sine;
      e.through = wind.climb + e.r * (wind.roll * sine - wind.pitch * cosine);
      visit(e, [&](double skew) {
        const double turn = turns_ * wind.speed * e.r;
        return Vector4(1.0 - skew * e.share * cosine, -wind.across * cosine,
                       -turn * sine - wind.across * cosine * cosine,
                       turn * cosine - wind.across * sine * cosine);
      });
    }
  }
}

// Lift is linear in the induced flow and in the flapping, whose equations are then linear, too:
//   mean       (I speed^2 + k) b_0 = M_0
//   harmonics  k b_1 = M_1 - 2 I speed (the hub's turn, gyroscopic)
BladeRotor::Response BladeRotor::SettledAt(const Wind& wind, double skew) const {
  Vector4 at_zero = Vector4::Zero();  // thrust of a blade and its moments about the hinge
  Eigen::Matrix4d slope = Eigen::Matrix4d::Zero();
  ForEachElement(wind, [&](const Element& e, const auto& through_by) {
    const double pitch = pitch_ + blades_.twist * (e.share - 0.75);
    const double lift = e.area * blades_.lift_slope * e.along;
    const Vector4 on(1.0, e.r, 2.0 * e.r * e.cosine, 2.0 * e.r * e.sine);
    at_zero += lift * (pitch * e.along - e.through) * on;
    slope -= lift * on * through_by(skew).transpose();
  });
  const double gyroscopic = 2.0 * flap_inertia_ * wind.speed * turns_;
  const Vector3d stiffness(flap_inertia_ * wind.speed * wind.speed + flap_stiffness_,
                           flap_stiffness_, flap_stiffness_);
  const Eigen::Matrix3d hinge =
      Eigen::Matrix3d(stiffness.asDiagonal()) - slope.bottomRightCorner<3, 3>();
  const Eigen::PartialPivLU<Eigen::Matrix3d> solve(hinge);
  const Vector3d still =
      solve.solve(Vector3d(at_zero.tail<3>() - gyroscopic * Vector3d(0.0, wind.roll, wind.pitch)));
  const Vector3d by_flow = solve.solve(Vector3d(slope.bottomLeftCorner<3, 1>()));
  const Eigen::RowVector3d by_flapping = slope.topRightCorner<1, 3>();
  Response response;
  response.skew = skew;
  response.values[0] = InducedBy(blades_.count * (at_zero[0] + by_flapping * still),
                                 blades_.count * (slope(0, 0) + by_flapping * by_flow), wind);
  response.values.tail<3>() = still + by_flow * response.values[0];
  return response;
}

// Glauert: thrust + slope v = 2 rho A v sqrt(across^2 + (climb + v)^2), by Newton from above, so
// that a descent keeps the flow of a rotor that works. No thrust induces no flow.
double BladeRotor::InducedBy(double thrust, double slope, const Wind& wind) const {
  if (!(thrust > 0.0)) return 0.0;
  double v = std::sqrt(thrust / (2.0 * disc_)) + std::max(0.0, -wind.climb);
  for (int i = 0; i < 20; ++i) {
    const double down = wind.climb + v, speed = std::hypot(wind.across, down);
    const double excess = 2.0 * disc_ * v * speed - thrust - slope * v;
    const double bend = 2.0 * disc_ * (speed + v * down / std::max(speed, 1e-9)) - slope;
    const double step = excess / bend;
    v = std::max(0.0, v - step);
    if (std::abs(step) < 1e-9) break;
  }
  return v;
}

// The skew of the wake depends on the flow (Coleman et al. 1945: tan of half its angle).
BladeRotor::Response BladeRotor::Settled(const Wind& wind) const {
  Response response = SettledAt(wind, 0.0);
  if (wind.across < 1e-6) return response;
  for (int i = 0; i < 2; ++i) {
    const double down = wind.climb + response.values[0];
    response = SettledAt(wind, (std::hypot(wind.across, down) - down) / wind.across);
  }
  return response;
}

BladeRotor::Loads BladeRotor::LoadsOn(const Wind& wind, const Response& response) const {
  Loads sum;
  ForEachElement(wind, [&](const Element& e, const auto& through_by) {
    const double through = e.through + through_by(response.skew).dot(response.values);
    const double pitch = pitch_ + blades_.twist * (e.share - 0.75);
    const double angle =
        response.values[1] + response.values[2] * e.cosine + response.values[3] * e.sine;
    const double lift = e.area * blades_.lift_slope * (pitch * e.along - through);  // per `along`
    const double drag = lift * through + e.area * profile_drag_ * e.along * e.along;
    const double inward = lift * e.along * angle;
    sum.force += Vector3d(turns_ * e.sine * drag - inward * e.cosine,
                          -turns_ * e.cosine * drag - inward * e.sine, lift * e.along);
    sum.torque += e.r * drag;
  });
  sum.force *= blades_.count;
  sum.torque *= blades_.count;
  return sum;
}

BladeRotor::BladeRotor(const BladeConfig& blades, const Rotor& rotor)
    : blades_(blades),
      axis_B_(rotor.axis),
      turns_(-rotor.spin),
      disc_(blades.air_density * M_PI * blades.radius * blades.radius),
      flap_inertia_(blades.mass * blades.radius * blades.radius / 3.0),
      flap_stiffness_(flap_inertia_ * std::pow(2.0 * M_PI * blades.flap_frequency, 2)) {
  const Wind still{1000.0, 0.0, 0.0, 0.0, 0.0};
  const double squared = still.speed * still.speed;
  const auto loads = [&] { return LoadsOn(still, Settled(still)); };
  double low = 0.0, high = kMostPitch;
  for (int i = 0; i < 50; ++i) {
    pitch_ = 0.5 * (low + high);
    (loads().force.z() < rotor.k_f * squared ? low : high) = pitch_;
  }
  const double lifting = loads().torque;
  profile_drag_ = 1.0;
  profile_drag_ = (rotor.k_m * squared - lifting) / (loads().torque - lifting);
  if (high == kMostPitch || !(profile_drag_ > 0.0)) {
    throw InputError(fmt::format(
        "blades of radius {} m and chord {} m can't give k_f {} N s^2 with k_m {} N m s^2; change "
        "them under simulation: blades",
        blades_.radius, blades_.chord, rotor.k_f, rotor.k_m));
  }
}

HubWrench BladeRotor::WrenchOn(const HubMotion& hub) const {
  const double climb = hub.v_B.dot(axis_B_);
  const Vector3d sideways = hub.v_B - climb * axis_B_;
  const double across = sideways.norm();
  const Vector3d first = across > 1e-6 ? Vector3d(sideways / across) : axis_B_.unitOrthogonal();
  Eigen::Matrix3d R_B_disc;
  R_B_disc << first, axis_B_.cross(first), axis_B_;
  const Wind wind{hub.speed, across, climb, hub.w_B.dot(R_B_disc.col(0)),
                  hub.w_B.dot(R_B_disc.col(1))};
  const Response response = Settled(wind);
  const Loads loads = LoadsOn(wind, response);
  const double bending = 0.5 * blades_.count * flap_stiffness_;
  const Vector3d moment(bending * response.values[3], -bending * response.values[2],
                        -turns_ * loads.torque);
  return {R_B_disc * loads.force, R_B_disc * moment};
}

}  // namespace trueline::simulation
