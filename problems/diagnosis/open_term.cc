#include "problems/diagnosis/open_term.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "problems/vgd/term_series.h"

namespace trueline {
namespace {

using Eigen::Vector3d;
using Factors = std::vector<TermFactor>;

constexpr double kLags[] = {0.1, 0.3, 1.0};  // s

Factors Motions(const TermScope& scope) {
  Factors motions;
  for (const TermQuantity of : {TermQuantity::kSpeedX, TermQuantity::kSpeedY, TermQuantity::kSpeedZ,
                                TermQuantity::kRateX, TermQuantity::kRateY, TermQuantity::kRateZ}) {
    motions.push_back({of});
  }
  motions.push_back({TermQuantity::kThrust, {scope.log.gravity}});
  return motions;
}

std::vector<Factors> Products(const Factors& motions) {
  std::vector<Factors> all;
  for (std::size_t i = 0; i < motions.size(); ++i) {
    all.push_back({motions[i]});
    TermFactor size = motions[i];
    size.size = true;
    all.push_back({size});
    for (std::size_t j = i; j < motions.size(); ++j) all.push_back({motions[i], motions[j]});
  }
  return all;
}

std::vector<Factors> Lagged(const Factors& motions) {
  std::vector<Factors> all;
  for (const TermFactor& motion : motions) {
    if (motion.of < TermQuantity::kRateX || motion.of > TermQuantity::kThrust) continue;
    for (const double lag : kLags) {
      all.push_back({motion});
      all.back().front().lag = lag;
    }
  }
  return all;
}

// Sine and cosine of the heading, so many times a turn.
std::vector<Factors> HeadingWaves(const std::vector<double>& periods) {
  std::vector<Factors> waves;
  for (const double n : periods) {
    waves.push_back({{TermQuantity::kSine, {n}}});
    waves.push_back({{TermQuantity::kCosine, {n}}});
  }
  return waves;
}

// North, east and above the middle of the flight; and time.
std::vector<Factors> PlacesAndTime(const std::vector<TermMotion>& flight) {
  Vector3d middle = Vector3d::Zero();
  for (const TermMotion& at : flight) middle += at.p_E / static_cast<double>(flight.size());
  const double from = flight.front().t, to = flight.back().t;
  return {{{TermQuantity::kNorth, {middle.x()}}},
          {{TermQuantity::kEast, {middle.y()}}},
          {{TermQuantity::kHeight, {-middle.z()}}},
          {{TermQuantity::kTime, {0.5 * (from + to), std::max(1e-3, 0.5 * (to - from))}}}};
}

// The heading once and twice a turn; battery voltage.
std::vector<Factors> HeadingsAndVoltage(const FlightLog& log) {
  std::vector<Factors> all = HeadingWaves({1.0, 2.0});
  if (log.battery.empty()) return all;
  double mean = 0.0;
  for (const auto& sample : log.battery) {
    mean += sample.value / static_cast<double>(log.battery.size());
  }
  all.push_back({{TermQuantity::kVoltage, {mean}}});
  return all;
}

constexpr double kLeastShare = 0.02;  // of the flight's time

// How much of the flight's time is spent at a hump.
double ShareOf(const TermFactor& hump, const std::vector<TermMotion>& flight) {
  double share = 0.0;
  for (const TermMotion& at : flight) {
    share += ValueOf<double>(hump, at) / static_cast<double>(flight.size());
  }
  return share;
}

// Smooth humps on two grids over the course, where the flight spends some time but not most of it,
// and slopes of those on the wide grid. Their edges are soft: between learned gusts a sharp edge at
// a wrong place refutes a push there.
std::vector<Factors> Humps(const std::vector<TermMotion>& flight) {
  constexpr double kGreatestShare = 0.4;  // of the flight's time
  Eigen::Vector2d low = flight.front().p_E.head<2>(), high = low;
  for (const TermMotion& at : flight) {
    low = low.cwiseMin(at.p_E.head<2>());
    high = high.cwiseMax(at.p_E.head<2>());
  }
  std::vector<Factors> humps;
  for (const int across : {5, 10}) {
    const double radius = (high - low).maxCoeff() / across;
    if (!(radius > 0.0)) break;
    const Eigen::Vector2i last = ((high - low) / radius).array().round().matrix().cast<int>();
    for (int north = 0; north <= last.x(); ++north) {
      for (int east = 0; east <= last.y(); ++east) {
        const Eigen::Vector2d at = low + radius * Eigen::Vector2d(north, east);
        const TermFactor hump{TermQuantity::kPlace, {at.x(), at.y(), radius}};
        const double share = ShareOf(hump, flight);
        if (share < kLeastShare || share > kGreatestShare) continue;
        humps.push_back({hump});
        if (across > 5) continue;
        humps.push_back({{TermQuantity::kSlopeNorth, hump.at}});
        humps.push_back({{TermQuantity::kSlopeEast, hump.at}});
      }
    }
  }
  return humps;
}

bool IsEarth(int axis) { return axis >= 3; }

// Fixes are wrong by a single motion, heading or place, if by any. Fixes that drift evenly are
// those of a vehicle that is as much faster, which its drag alone tells apart.
bool MayMoveFixes(const Factors& variable) {
  const TermFactor& first = variable[0];
  return variable.size() == 1 && !first.size && first.lag == 0.0 && !IsLocal(variable) &&
         first.of != TermQuantity::kTime;
}

// A gust pushes the vehicle, and the controller turns the thrust against the push a little later.
// So every controlled vehicle shows a force correlated with a lagging turn rate. A vehicle that
// holds its heading shows it along the earth's axes, too. One that hovers turns for nothing else,
// so that the rates themselves go with gusts.
bool IsControl(TermOn on, int axis, const Factors& variable, bool hovers) {
  if (on != TermOn::kForce || (variable[0].lag == 0.0 && !hovers)) return false;
  const TermQuantity of = variable[0].of;
  if (axis % 3 == 2) return of == TermQuantity::kThrust;  // z_B and down
  const bool pitches = of == TermQuantity::kRateY, rolls = of == TermQuantity::kRateX;
  if (IsEarth(axis)) return pitches || rolls;
  return axis == 0 ? pitches : rolls;
}

bool Hovers(const std::vector<TermMotion>& motions) {
  constexpr double kSpeed = 1.0;  // m/s, rms
  double squares = 0.0;
  for (const TermMotion& motion : motions) squares += motion.v_B.squaredNorm();
  return squares < kSpeed * kSpeed * static_cast<double>(motions.size());
}

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

std::string PhysicsOf(const TermForm& term) {
  static const std::vector<std::pair<std::string, std::string>> known = {
      {"force along x_B with forward speed", "linear drag"},
      {"force along y_B with sideways speed", "linear drag"},
      {"force along x_B with pitch rate", "rotors' drag above or below the centre of mass"},
      {"force along y_B with roll rate", "rotors' drag above or below the centre of mass"},
      {"force along x_B with the square of forward speed", "quadratic drag, or lift of the body"},
      {"force along x_B with thrust above hover", "a thrust axis that is not z_B"},
      {"force along y_B with thrust above hover", "a thrust axis that is not z_B"},
      {"force along z_B with forward speed", "translational lift"},
      {"force along z_B with sink rate", "inflow of the rotors"},
      {"moment along x_B with roll rate", "damping of the rotors"},
      {"moment along y_B with pitch rate", "damping of the rotors"},
      {"moment along y_B with forward speed", "drag at the height of the rotors; flapping"},
      {"moment along x_B with sideways speed", "drag at the height of the rotors; flapping"},
      {"attitude about down with the sine of twice the heading", "soft iron near the compass"},
      {"attitude about down with the cosine of twice the heading", "soft iron near the compass"},
      {"attitude about down with the sine of the heading", "hard iron near the compass"},
      {"attitude about down with the cosine of the heading", "hard iron near the compass"},
      {"fix along x_B with forward speed", "fixes that are late or early"},
      {"fix along y_B with sideways speed", "fixes that are late or early"}};
  for (const auto& [form, physics] : known) {
    if (form == term.Name()) return physics;
  }
  const bool local = term.on == TermOn::kForce && IsEarth(term.axis) && IsLocal(term.with);
  return local ? "moving air at this place" : "";
}

std::vector<std::vector<TermFactor>> TermVariables(const TermScope& scope) {
  const Factors motions = Motions(scope);
  std::vector<Factors> all = Products(motions);
  for (const auto& more : {Lagged(motions), HeadingsAndVoltage(scope.log),
                           PlacesAndTime(scope.motions), Humps(scope.motions)}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  for (Factors& variable : all) BindTerms(scope.log, &variable);
  return all;
}

std::vector<TermForm> OpenTerms(const TermScope& scope) {
  const bool rotors = scope.drive == DriveKind::kRotors;
  std::vector<std::pair<TermOn, std::vector<int>>> changed = {
      {TermOn::kForce, rotors ? std::vector<int>{0, 1, 2, 3, 4} : std::vector<int>{0, 1, 3, 4}},
      {TermOn::kAttitude, {0, 1, 5}},
      {TermOn::kFix, {0, 1, 2, 3, 4, 5}}};
  if (rotors) changed.push_back({TermOn::kTurn, {0, 1, 2}});
  // Where rotors drive the model, short flights in a small room turn for the pilot's sake.
  const bool hovers = !rotors && Hovers(scope.motions);
  std::vector<TermForm> terms;
  for (const Factors& variable : TermVariables(scope)) {
    const bool local = IsLocal(variable);
    for (const auto& [on, axes] : changed) {
      if (on == TermOn::kFix && !MayMoveFixes(variable)) continue;
      for (const int axis : axes) {
        if (IsControl(on, axis, variable, hovers)) continue;
        const bool suits = !local || (on == TermOn::kForce && IsEarth(axis));
        if (suits || (local && on == TermOn::kAttitude && IsEarth(axis))) {
          terms.push_back({on, axis, variable});
        }
      }
    }
  }
  if (!rotors && !scope.log.gates.empty()) {
    terms.push_back(
        {TermOn::kFix, 6, {{TermQuantity::kGateDistance}, {TermQuantity::kGateDistance}}});
  }
  return terms;
}

std::vector<TermForm> HumpsToldBy(const TermForm& term) {
  constexpr double kSide = 0.7;  // of the radius: where a slope is greatest
  if (term.with.size() != 1 || !IsLocal(term.with)) return {};
  TermForm hump = term;
  hump.with[0].of = TermQuantity::kPlace;
  if (term.with[0].of == TermQuantity::kPlace) return {hump};
  const std::size_t along = term.with[0].of == TermQuantity::kSlopeNorth ? 0 : 1;
  std::vector<TermForm> sides(2, hump);
  sides[0].with[0].at[along] -= kSide * hump.with[0].at[2];
  sides[1].with[0].at[along] += kSide * hump.with[0].at[2];
  return sides;
}

std::vector<TermForm> NearbyHumps(const TermForm& hump, const std::vector<TermMotion>& flight,
                                  double step) {
  std::vector<TermForm> nearby{hump};
  const auto add = [&](double dx, double dy, double wider, bool other_edge) {
    TermForm moved = hump;
    std::vector<double>& at = moved.with[0].at;
    const bool flat = (at.size() > 3) != other_edge;
    at.resize(flat ? 4 : 3);
    if (flat) at[3] = 4.0;
    at[0] += dx * at[2];
    at[1] += dy * at[2];
    at[2] *= wider;
    if (ShareOf(moved.with[0], flight) >= kLeastShare) nearby.push_back(moved);
  };
  for (const double wider : {1.0 / (1.0 + step), 1.0, 1.0 + step}) {
    for (const double dx : {-step, 0.0, step}) {
      for (const double dy : {-step, 0.0, step}) add(dx, dy, wider, false);
    }
    add(0.0, 0.0, wider, true);
  }
  return nearby;
}

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
