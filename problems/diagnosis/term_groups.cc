// Terms that each round of a search tests beside the effects.
#include <cmath>

#include "problems/diagnosis/open_term.h"

namespace trueline {
namespace {

using Factors = std::vector<TermFactor>;

// One term for each axis, all with the same factors.
std::vector<TermForm> Along(TermOn on, const std::vector<int>& axes, const Factors& with) {
  std::vector<TermForm> terms;
  for (const int axis : axes) terms.push_back({on, axis, with});
  return terms;
}

// One term for each of x, y, z; the factors by axis.
std::vector<TermForm> ByAxis(TermOn on, const std::vector<Factors>& with) {
  std::vector<TermForm> terms;
  for (const Factors& factors : with)
    terms.push_back({on, static_cast<int>(terms.size()), factors});
  return terms;
}

// Errors of a heading that go with the heading, `periods` times a turn.
std::vector<TermForm> HeadingErrors(const std::vector<double>& periods) {
  std::vector<TermForm> terms;
  for (const Factors& wave : HeadingWaves(periods)) terms.push_back({TermOn::kAttitude, 5, wave});
  return terms;
}

}  // namespace

std::vector<TermGroup> TermGroups(const TermScope& scope) {
  using enum TermQuantity;
  using enum TermOn;
  const TermFactor u{kSpeedX}, v{kSpeedY}, w{kSpeedZ}, p{kRateX}, q{kRateY}, r{kRateZ};
  const TermFactor thrust{kThrust, {scope.log.gravity}};
  const auto size = [](TermFactor factor) {
    factor.size = true;
    return factor;
  };
  const std::vector<Factors> places = PlacesAndTime(scope.motions);
  const Factors &north = places[0], &east = places[1], &time = places[3];
  std::vector<TermGroup> groups{{"sideways speed, across axes", ByAxis(kForce, {{v}, {u}})},
                                {"place, north to south", Along(kForce, {3, 4}, north)},
                                {"place, east to west", Along(kForce, {3, 4}, east)}};
  const std::vector<TermGroup> imu{
      {"climb rate", Along(kForce, {0, 1}, {w})},
      {"turn rate", Along(kForce, {0, 1}, {r})},
      {"turn rate and speed", Along(kForce, {0, 1}, {r, u})},
      {"thrust", Along(kForce, {0, 1}, {thrust})},
      {"cube of speed", ByAxis(kForce, {{u, u, u}, {v, v, v}})},
      {"an error of heading with two periods a turn", HeadingErrors({2.0})},
      {"time, with a force from one side", Along(kForce, {3, 4}, time)},
      {"square of the distance to the gate", {{kFix, 6, {{kGateDistance}, {kGateDistance}}}}}};
  const std::vector<TermGroup> rotors{
      {"square of speed", ByAxis(kForce, {{u, size(u)}, {v, size(v)}, {w, size(w)}})},
      {"turn rates, as a force", ByAxis(kForce, {{q}, {p}})},
      {"thrust, as a force", Along(kForce, {0, 1, 2}, {thrust})},
      {"square of thrust", {{kForce, 2, {thrust, thrust}}}},
      {"time, as a force in body axes", Along(kForce, {0, 1, 2}, time)},
      {"a force from one side", Along(kForce, {3, 4}, {})},
      // Rotors brake turns: a hub that rises meets more air (Leishman, ch. 5).
      {"turn rates, as a moment", ByAxis(kTurn, {{p}, {q}, {r}}), true},
      {"speed, as a moment", ByAxis(kTurn, {{v}, {u}})},
      {"time, as a moment", Along(kTurn, {0, 1, 2}, time)},
      {"a constant moment", {{kTurn, 2, {}}}},
      {"thrust, as the accelerometer reads it", {{kAccelerometer, 2, {thrust}}}, true},
      {"thrust, as the accelerometer reads it across", Along(kAccelerometer, {0, 1}, {thrust}),
       true},
      {"turn rates, as the gyro reads them", ByAxis(kGyro, {{p}, {q}, {r}}), true},
      {"heading, as the attitude is read", HeadingErrors({1.0, 2.0}), true}};
  const std::vector<TermGroup>& own = scope.drive == DriveKind::kRotors ? rotors : imu;
  groups.insert(groups.end(), own.begin(), own.end());
  return groups;
}

std::vector<TermForm> TermsOf(const std::vector<TermGroup>& groups) {
  std::vector<TermForm> all;
  for (const TermGroup& g : groups) all.insert(all.end(), g.terms.begin(), g.terms.end());
  return all;
}

double OrdinarySize(const TermForm& term, const std::vector<TermMotion>& flight) {
  // m/s^2, rad/s^2, rad, m, m/s^2, rad/s; in the order of TermOn
  constexpr double kLeast[] = {0.005, 0.05, 1e-3, 0.005, 0.005, 5e-4};
  double sum = 0.0;
  for (const TermMotion& at : flight) sum += term.At(at).squaredNorm();
  const double rms = std::sqrt(sum / static_cast<double>(flight.size()));
  return kLeast[static_cast<int>(term.on)] / std::max(rms, 1e-9);
}

TermColumns TermColumnsOf(const TermGroup& group, const std::vector<TermMotion>& flight,
                          std::vector<int> columns) {
  Eigen::VectorXd ordinary(std::ssize(group.terms));
  for (Eigen::Index i = 0; i < ordinary.size(); ++i) {
    // A group decides a verdict, a single term is only described.
    ordinary[i] = 2.0 * OrdinarySize(group.terms[i], flight);
  }
  return {group.name, std::move(columns), std::move(ordinary), group.held};
}

}  // namespace trueline
