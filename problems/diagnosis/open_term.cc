#include "problems/diagnosis/open_term.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

namespace trueline {
namespace {

using Eigen::Vector3d;

constexpr std::array<const char*, 6> kAxes = {"x_B", "y_B", "z_B", "north", "east", "down"};

std::vector<TermVariable> Motions() {
  using M = const TermMotion&;
  return {{"forward speed", "m/s", 1, [](M a) { return a.v_B.x(); }},
          {"sideways speed", "m/s", 1, [](M a) { return a.v_B.y(); }},
          {"sink rate", "m/s", 1, [](M a) { return a.v_B.z(); }},
          {"roll rate", "rad/s", 1, [](M a) { return a.w_B.x(); }},
          {"pitch rate", "rad/s", 1, [](M a) { return a.w_B.y(); }},
          {"yaw rate", "rad/s", 1, [](M a) { return a.w_B.z(); }},
          {"thrust above hover", "m/s^2", 1, [](M a) { return a.thrust; }}};
}

TermVariable Product(const TermVariable& a, const TermVariable& b) {
  const bool square = a.name == b.name;
  return {square ? "the square of " + a.name : a.name + " times " + b.name,
          square ? "(" + a.unit + ")^2" : a.unit + " " + b.unit, 2,
          [a = a.value, b = b.value](const TermMotion& at) { return a(at) * b(at); }};
}

TermVariable SizeOf(const TermVariable& a) {
  return {"the size of " + a.name, a.unit, 2,
          [a = a.value](const TermMotion& at) { return std::abs(a(at)); }};
}

// Sine and cosine of the heading, once and twice a turn.
std::vector<TermVariable> Headings() {
  std::vector<TermVariable> headings;
  for (const int periods : {1, 2}) {
    const std::string angle = periods == 1 ? "the heading" : "twice the heading";
    headings.push_back({"the sine of " + angle, "1", periods + 1, [periods](const TermMotion& at) {
                          return std::sin(periods * at.Heading());
                        }});
    headings.push_back(
        {"the cosine of " + angle, "1", periods + 1,
         [periods](const TermMotion& at) { return std::cos(periods * at.Heading()); }});
  }
  return headings;
}

// Smooth humps on two grids over the course, where the flight spends some time but not most of it.
// Their edges are soft: between learned gusts a sharp edge at a wrong place refutes a push there.
std::vector<TermVariable> Humps(const std::vector<TermMotion>& flight) {
  constexpr double kLeastShare = 0.02, kGreatestShare = 0.4;  // of the flight's time
  Eigen::Vector2d low = flight.front().p_E.head<2>(), high = low;
  for (const TermMotion& at : flight) {
    low = low.cwiseMin(at.p_E.head<2>());
    high = high.cwiseMax(at.p_E.head<2>());
  }
  std::vector<TermVariable> humps;
  for (const int across : {5, 10}) {
    const double radius = (high - low).maxCoeff() / across;
    if (!(radius > 0.0)) break;
    for (double x = low.x(); x < high.x() + 0.5 * radius; x += radius) {
      for (double y = low.y(); y < high.y() + 0.5 * radius; y += radius) {
        const Eigen::Vector2d centre(x, y);
        const auto hump = [centre, radius](const TermMotion& at) {
          return std::exp(-(at.p_E.head<2>() - centre).squaredNorm() / (radius * radius));
        };
        double share = 0.0;
        for (const TermMotion& at : flight) {
          share += hump(at) / static_cast<double>(flight.size());
        }
        if (share < kLeastShare || share > kGreatestShare) continue;
        const std::string name =
            fmt::format("being within about {:.1f} m of ({:.1f}, {:.1f})", radius, x, y);
        humps.push_back({name, "1", 2, hump, true});
      }
    }
  }
  return humps;
}

// As above, below, north and east of the middle of the flight; and time.
std::vector<TermVariable> Places(const std::vector<TermMotion>& flight) {
  Vector3d middle = Vector3d::Zero();
  for (const TermMotion& at : flight) middle += at.p_E / static_cast<double>(flight.size());
  using M = const TermMotion&;
  return {{fmt::format("the distance north of x = {:.1f} m", middle.x()), "m", 1,
           [x = middle.x()](M at) { return at.p_E.x() - x; }},
          {fmt::format("the distance east of y = {:.1f} m", middle.y()), "m", 1,
           [y = middle.y()](M at) { return at.p_E.y() - y; }},
          {fmt::format("the height above {:.1f} m", -middle.z()), "m", 1,
           [z = middle.z()](M at) { return z - at.p_E.z(); }},
          {"time (half of the flight)", "1", 1, [](M at) { return at.s; }}};
}

bool IsEarth(int axis) { return axis >= 3; }

}  // namespace

double TermMotion::Heading() const { return std::atan2(R_E_B(1, 0), R_E_B(0, 0)); }

Vector3d OpenTerm::At(const TermMotion& at) const {
  const double size = with.value(at);
  if (IsEarth(axis)) return size * at.R_E_B.row(axis - 3).transpose();
  return size * Vector3d::Unit(axis);
}

std::string OpenTerm::Enters() const {
  return on == TermOn::kForce ? "force" : on == TermOn::kTurn ? "moment" : "attitude";
}

std::string OpenTerm::Along() const { return kAxes[axis]; }

std::string OpenTerm::Name() const {
  return fmt::format("{} {} {} with {}", Enters(), on == TermOn::kAttitude ? "about" : "along",
                     Along(), with.name);
}

std::string OpenTerm::Unit() const {
  const std::string unit = on == TermOn::kForce ? "m/s^2" : on == TermOn::kTurn ? "rad/s^2" : "rad";
  return with.unit == "1" ? unit : unit + " for each " + with.unit;
}

std::string OpenTerm::Text(double size, double sigma) const {
  const char* what = on == TermOn::kForce  ? "a force along"
                     : on == TermOn::kTurn ? "a moment about"
                                           : "an attitude that is logged wrong about";
  const std::string of = with.unit == "1" ? " times " : " of ";
  return fmt::format("{} {} of {:.3g} +- {:.2g} {}{}", what, Along(), size, sigma, Unit(),
                     with.local ? " while" + with.name.substr(5) : of + with.name);
}

std::string OpenTerm::Physics() const {
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
      {"attitude about down with the cosine of the heading", "hard iron near the compass"}};
  for (const auto& [form, physics] : known) {
    if (form == Name()) return physics;
  }
  if (on == TermOn::kForce && IsEarth(axis) && with.local) {
    return "moving air at this place";
  }
  return "";
}

std::vector<TermVariable> TermVariables(const std::vector<TermMotion>& flight) {
  std::vector<TermVariable> all = Motions();
  const std::size_t motions = all.size();
  for (std::size_t i = 0; i < motions; ++i) {
    all.push_back(SizeOf(all[i]));
    for (std::size_t j = i; j < motions; ++j) all.push_back(Product(all[i], all[j]));
  }
  for (const auto& more : {Headings(), Places(flight), Humps(flight)}) {
    all.insert(all.end(), more.begin(), more.end());
  }
  return all;
}

std::vector<OpenTerm> OpenTerms(DriveKind drive, const std::vector<TermMotion>& flight) {
  const bool rotors = drive == DriveKind::kRotors;
  std::vector<std::pair<TermOn, std::vector<int>>> changed = {
      {TermOn::kForce, rotors ? std::vector<int>{0, 1, 2, 3, 4} : std::vector<int>{0, 1, 3, 4}},
      {TermOn::kAttitude, {0, 1, 5}}};
  if (rotors) changed.push_back({TermOn::kTurn, {0, 1, 2}});
  std::vector<OpenTerm> terms;
  for (const TermVariable& variable : TermVariables(flight)) {
    for (const auto& [on, axes] : changed) {
      for (const int axis : axes) {
        if (!variable.local || IsEarth(axis)) terms.push_back({on, axis, variable});
      }
    }
  }
  return terms;
}

}  // namespace trueline
