#include <fmt/format.h>

#include <array>
#include <cmath>
#include <set>

#include "problems/simulators/audit.h"

namespace trueline {
namespace {

constexpr double kRpm2 = 91.189;       // (60 / 2 pi)^2
constexpr double kSmallVehicle = 0.1;  // kg
constexpr double kSlack = 1e-3;        // relative, of digits that were left out
constexpr double kMeasured = 0.02;     // relative, of moments that were measured one by one
constexpr double kAgain = 0.01;        // relative, of numbers that a file repeats

// A ratio that every vehicle has within a range. Sources: the vehicles of the simulators
// themselves, from 27 g to 2 kg, and measured ones, with a margin of two or more to each side.
struct Range {
  const char* parameter;
  const char* what;
  double low, high;
  const char* source;
};

constexpr Range kMassForArm = {"m", "mass over the cube of the arm, kg/m^3", 20.0, 1500.0,
                               "multirotors from 27 g to 2 kg have 70 to 400"};
constexpr Range kGyration = {"I", "radius of gyration over the rotors' distance from the axis",
                             0.35, 1.25,
                             "multirotors from 27 g to 2 kg have 0.55 to 1.1; all mass at the "
                             "rotors makes it 1"};
constexpr Range kFlat = {"I_z", "moment about z over the larger of the others", 0.9, 2.1,
                         "rotors in a plane make it 1.3 to 1.9 in vehicles from 27 g to 2 kg"};
constexpr Range kThrustForArm = {
    "k_f", "k_f over air density and the fourth power of the arm", 2e-4, 4e-2,
    "propellers of thrust coefficient 0.05 to 0.15, half an arm to 1.4 arms wide"};
constexpr Range kMomentForThrust = {"k_m", "k_m over k_f, m", kLeastMoment, kMostMoment,
                                    "propellers of 5 to 40 cm have 0.003 to 0.04, PX4's Iris 0.06"};
constexpr Range kHover = {"full_speed", "share of the full thrust in hover", 0.08, 0.8,
                          "racers hover at 10 %, loaded vehicles below 80 %"};
constexpr Range kHoverSmall = {"full_speed", "share of the full thrust in hover", 0.18, 0.8,
                               "vehicles below 0.1 kg hover at 30 to 75 %"};
constexpr Range kLag = {"tau", "lag of the rotors, s", 0.01, 0.3,
                        "measured rotors have 0.012 s (5 inch) to 0.1 s (brushed); shorter is "
                        "optimistic"};
constexpr Range kDrag = {"K", "linear drag near hover, 1/s", -1.5, -0.05,
                         "measured vehicles have -0.2 to -0.5"};

double ArmOf(const NeutralVehicle& v) {
  return v.Get("arm") > 0.0 ? v.Get("arm") : v.Get("link_arm");
}

constexpr double kAir = 1.225;  // kg/m^3

// k_f over air density and the fourth power of the arm.
double ThrustForArm(const NeutralVehicle& v) {
  return v.Get("k_f") / (kAir * std::pow(ArmOf(v), 4));
}

// What k_f is too small by where it stands in another unit, else 1.
double OtherUnit(double thrust_for_arm) {
  for (const double factor : {kRpm2, 1.0 / kRpm2}) {
    const double right = thrust_for_arm * factor;
    if (right > kThrustForArm.low && right < kThrustForArm.high) return factor;
  }
  return 1.0;
}

// m, root mean square, of the rotors from a body axis (0 to 2).
double RotorsFromAxis(const NeutralVehicle& v, int axis) {
  if (!(v.Get("arm") > 0.0)) return v.Get("link_arm") * (axis == 2 ? 1.0 : std::sqrt(0.5));
  double squares = 0.0;
  for (int i = 0; i < static_cast<int>(v.rotors.size()); ++i) {
    if (axis != 0) squares += std::pow(v.Get("x_M", i), 2);
    if (axis != 1) squares += std::pow(v.Get("y_M", i), 2);
  }
  return std::sqrt(squares / v.Get("n"));
}

// `v` with another mass. What is stated by mass follows.
NeutralVehicle WithMass(NeutralVehicle v, double ratio) {
  v.body["m"] *= ratio;
  for (const NeutralInfo& info : kNeutral) {
    const std::string_view meaning = info.meaning;
    const bool by_mass = meaning.ends_with("by mass") || meaning.ends_with("and mass");
    if (by_mass && v.States(info.name)) v.body[info.name] /= ratio;
  }
  return v;
}

NeutralVehicle WithThrust(NeutralVehicle v, double ratio) {
  for (Numbers& rotor : v.rotors) rotor["k_f"] *= ratio;
  return v;
}

// A number whose error makes others look wrong, and the ratio to the arm that bounds it.
struct Root {
  const char* parameter;
  NeutralVehicle (*with)(NeutralVehicle, double ratio);
  double (*for_arm)(const NeutralVehicle&);
  Range range;
};
const Root kRoots[] = {
    {"m", &WithMass, [](const NeutralVehicle& v) { return v.Get("m") / std::pow(ArmOf(v), 3); },
     kMassForArm},
    {"k_f", &WithThrust, &ThrustForArm, kThrustForArm}};

constexpr const char* kAboveZero[] = {"m",          "body_mass", "k_f",   "k_m",     "I_x",
                                      "I_y",        "I_z",       "box_x", "box_y",   "box_z",
                                      "full_speed", "arm",       "lever", "lever_x", "lever_y"};

// `at`: the place; null: where the file states the parameter.
Contradicted FindingAt(const VehicleFile& file, const std::string& parameter, double value,
                       const std::string& text, const Reading* at = nullptr) {
  const NeutralInfo* info = FindNeutral(parameter);
  Contradicted finding{parameter, info != nullptr ? info->unit : "", value, text};
  Place(file, at != nullptr ? at : file.Find(parameter), &finding);
  return finding;
}

constexpr Range kCurve = {"k_f_1", "power of the rotors' speed by which thrust grows in hover", 1.4,
                          2.8, "propellers have 2, fits to measured ones 1.8 to 2.5"};

class Checker {
 public:
  explicit Checker(const VehicleFile& file) : file_(file), v_(file.vehicle) {}

  std::vector<Contradicted> Run() {
    Inertia();
    Flatness();
    Sizes();
    Rotors();
    Motors();
    Signs();
    Drag();
    Repeated();
    return findings_;
  }

 private:
  // The first finding of a parameter counts.
  void Add(const std::string& parameter, double value, const std::string& text,
           const Reading* at = nullptr) {
    if (Names(findings_, parameter)) return;
    findings_.push_back(FindingAt(file_, parameter, value, text, at));
  }
  // False, and a finding, outside of the range. `hint`: what may explain it.
  bool Within(const Range& range, const std::string& parameter, double ratio,
              const std::string& hint = "") {
    const bool inside = ratio >= range.low * (range.low > 0.0 ? 1.0 - kSlack : 1.0 + kSlack) &&
                        ratio <= range.high * (range.high > 0.0 ? 1.0 + kSlack : 1.0 - kSlack);
    if (inside || !std::isfinite(ratio)) return true;
    Add(parameter, v_.Get(parameter),
        fmt::format("{}: {:.3g}, outside of {:.3g} to {:.3g} ({}){}", range.what, ratio, range.low,
                    range.high, range.source, hint));
    return false;
  }

  void Inertia() {
    for (const auto& [name, text] : ImpossibleInertia(v_)) Add(name, v_.Get(name), text);
  }

  // Of a flat vehicle I_z is the largest.
  void Flatness() {
    const double larger = std::max(v_.Get("I_x"), v_.Get("I_y"));
    if (!(larger > 0.0) || !(v_.Get("I_z") > 0.0) || v_.Get("I_z") > larger) return;
    Within(kFlat, "I_z", v_.Get("I_z") / larger, "; axes may be exchanged");
  }

  // Mass, inertia and thrust against the distance of the rotors.
  void Sizes() {
    const double arm = ArmOf(v_), mass = v_.Get("m");
    if (!(arm > 0.0)) return;
    if (mass > 0.0 && !Within(kMassForArm, "m", mass / std::pow(arm, 3), "; or the arm is")) {
      findings_.back().confused_with = {"arm"};
    }
    for (int axis = 0; axis < 3; ++axis) {
      const std::string name = std::string("I_") + "xyz"[axis];
      const double lever = RotorsFromAxis(v_, axis);
      if (!(mass > 0.0) || !(v_.Get(name) > 0.0) || !(lever > 0.0)) continue;
      Within(kGyration, name, std::sqrt(v_.Get(name) / mass) / lever,
             "; mass and inertia do not go together");
    }
    if (file_.target->by_thrust || !(v_.Get("k_f") > 0.0)) return;
    const double ratio = ThrustForArm(v_), unit = OtherUnit(ratio);
    Within(kThrustForArm, "k_f", ratio,
           unit > 1.0   ? "; it would be right in N/rpm^2 for N/(rad/s)^2"
           : unit < 1.0 ? "; it would be right in N/(rad/s)^2 for N/rpm^2"
                        : "");
  }

  void Rotors() {
    const auto n = v_.rotors.size();
    std::vector<std::pair<double, std::size_t>> around;
    for (std::size_t i = 0; i < n; ++i) {
      if (!v_.rotors[i].contains("x") || !v_.rotors[i].contains("spin")) return;
      around.emplace_back(v_.Get("angle", static_cast<int>(i)), i);
    }
    if (n != 4 && n != 6) return;
    std::sort(around.begin(), around.end());
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t i = around[k].second, j = around[(k + 1) % n].second;
      const double apart =
          std::abs(std::remainder(around[(k + 1) % n].first - around[k].first, 2.0 * M_PI));
      if (apart < 0.1) {
        Add("angle", around[k].first, fmt::format("rotors {} and {} stand at one place", i, j));
        break;
      }
      if (v_.rotors[i].at("spin") != v_.rotors[j].at("spin")) continue;
      Add("spin", v_.rotors[i].at("spin"),
          fmt::format("rotors {} and {} stand side by side and turn the same way: order of the "
                      "rotors and spins do not go together",
                      i, j));
      break;
    }
    const std::vector<FixedRotor> order = OrderOf(file_);
    for (std::size_t i = 0; i < std::min(n, order.size()); ++i) {
      const double along = v_.rotors[i].at("x") * order[i].x,
                   across = v_.rotors[i].at("y") * order[i].y;
      // The order is that of a frame whose rotors stand beside the axes, not on them.
      if (along * across == 0.0 || (along > 0.0 && across > 0.0)) continue;
      Add("x", v_.rotors[i].at("x"),
          fmt::format("rotor {} stands elsewhere than the simulator's code assumes ({} {})", i,
                      order[i].x > 0 ? "front" : "rear", order[i].y > 0 ? "right" : "left"));
      break;
    }
  }

  void Motors() {
    if (const Reading* square = file_.Find("k_f"); square != nullptr && file_.Find("k_f_1")) {
      const double slope = 2.0 * square->value + file_.Find("k_f_1")->value / v_.Get("w_h");
      Within(kCurve, "k_f_1", slope / v_.Get("k_f"));
    }
    if (v_.Get("k_m") > 0.0 && v_.Get("k_f") > 0.0) {
      Within(kMomentForThrust, "k_m", v_.Get("k_m") / v_.Get("k_f"));
    }
    if (v_.Get("full_speed") > 0.0 && v_.Get("m") > 0.0 && v_.Get("k_f") > 0.0) {
      const double share = std::pow(v_.Get("w_h") / v_.Get("full_speed"), 2);
      const bool small = v_.Get("m") < kSmallVehicle;
      const char* at = file_.Find("full_speed") != nullptr ? "full_speed" : "k_f";
      Within(small ? kHoverSmall : kHover, at, share,
             fmt::format("; thrust to weight {:.2f}", 1.0 / share));
    }
    for (const char* name : {"tau", "tau_down"}) {
      const double tau = v_.Get(name);
      if (!v_.States(name) || tau == 0.0) continue;
      const bool rate = tau > kLag.high && 1.0 / tau > kLag.low && 1.0 / tau < kLag.high;
      if (!Within(kLag, name, tau, rate ? "; it would be right as a rate, 1/s" : "")) break;
    }
  }

  // Numbers of which only one sign is physics; of some, zero is not either.
  void Signs() {
    for (const Reading& reading : file_.readings) {
      const std::string name = reading.field->name;
      if (reading.value > 0.0 || std::ranges::find(kAboveZero, name) == std::end(kAboveZero))
        continue;
      if (name == "k_m" && Names(findings_, "k_f")) continue;  // files state it by k_f
      Add(name == "body_mass" ? "m" : name, reading.value, kNotPositive, &reading);
    }
    // A mass of the wrong sign turns what is counted by it.
    const bool by_mass = Names(findings_, "m") && !(v_.Get("m") > 0.0);
    constexpr const char* kPositive[] = {"tau",          "tau_down", "rotor_speed_drag",
                                         "rotor_inflow", "damping",  "quadratic_damping",
                                         "J_r"};
    for (const Reading& reading : file_.readings) {
      const std::string name = reading.field->name;
      if (reading.value >= 0.0 || std::ranges::find(kPositive, name) == std::end(kPositive))
        continue;
      const bool air = name.find("damping") != std::string::npos || name.starts_with("rotor_");
      if (air && by_mass) continue;
      Add(name, reading.value,
          air ? "of this sign it accelerates the vehicle" : "can't be negative", &reading);
    }
    if (!by_mass && v_.Get("K_z") > 0.0)
      Add("K_z", v_.Get("K_z"), "of this sign it accelerates the vehicle");
  }

  void Drag() {
    if (!(v_.Get("m") > 0.0)) return;
    const bool by_speed = v_.States("rotor_speed_drag") && v_.Get("k_f") > 0.0;
    const double sum = by_speed ? v_.Get("S_h") : 0.0;
    for (const char axis : {'x', 'y'}) {
      const std::string name = std::string("K_") + axis;
      const double drag = v_.Get(name) - v_.Get("rotor_speed_drag") * sum;
      if (drag == 0.0) continue;  // the file has no such drag
      const std::string at = by_speed ? "rotor_speed_drag" : name;
      if (!Within(kDrag, at, drag, drag > 0.0 ? "; it accelerates the vehicle" : "")) break;
    }
    for (const char* name : {"c_x", "c_y", "c_z"}) {
      if (v_.Get(name) >= 0.0) continue;
      Add(name, v_.Get(name), "quadratic drag of this sign accelerates the vehicle");
      break;
    }
  }

  void Repeated() {
    for (const Reading& reading : file_.readings) {
      if (!reading.field->again) continue;
      const std::string name = reading.field->name;
      double stated = v_.Get(name, reading.rotor), again = reading.value;
      if (name == "angle") again = stated + std::remainder(again - stated, 2.0 * M_PI);
      const double scale = name == "angle" ? 1.0 : std::abs(stated);
      // A controller leaves the rotors' mass out, or counts the arm from another centre.
      if (std::abs(again - stated) <= kRepeated * scale) continue;
      const std::string rotor =
          reading.rotor >= 0 ? fmt::format(" of rotor {}", reading.rotor) : "";
      Add(name, again,
          fmt::format("{}{} is {:.4g} here and {:.4g} by the rest of the file{}", name, rotor,
                      again, stated, file_.files.size() > 1 ? "s" : ""),
          &reading);
    }
  }

  static constexpr double kRepeated = 0.1;  // relative

  const VehicleFile& file_;
  const NeutralVehicle& v_;
  std::vector<Contradicted> findings_;
};

// Of `findings`, those that stay with the best value that the root can have.
std::vector<Contradicted> LeftBeside(const Root& root, const VehicleFile& file,
                                     const std::vector<Contradicted>& findings) {
  constexpr int kSteps = 40;
  const double stated = root.for_arm(file.vehicle);
  std::vector<Contradicted> least = findings;
  for (int k = 0; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps;
    VehicleFile changed = file;
    const double wanted = root.range.low * std::pow(root.range.high / root.range.low, share);
    changed.vehicle = root.with(file.vehicle, wanted / stated);
    const std::vector<Contradicted> with = Checker(changed).Run();
    std::vector<Contradicted> left = findings;
    std::erase_if(left, [&](const Contradicted& f) { return !Names(with, f.parameter); });
    if (left.size() < least.size()) least = std::move(left);
  }
  return least;
}

// Files have origins of their own: where the centre of mass stands between the rotors is compared.
// Returns how far the two are apart, m: moments of inertia about them differ by that, too.
double CompareCentres(const VehicleFile& first, const VehicleFile& second,
                      std::vector<Contradicted>* findings) {
  constexpr double kSameCentre = 0.05;  // of the arm
  const NeutralVehicle &a = first.vehicle, &b = second.vehicle;
  double squares = 0.0;
  if (!a.Flies() || !b.Flies()) return 0.0;
  for (const char* name : {"r_BM_x", "r_BM_y", "r_BM_z"}) {
    const int axis = name[5] - 'x';
    const double one = a.CentreFromRotors(axis), other = b.CentreFromRotors(axis);
    if (std::abs(one - other) <= kSameCentre * std::max(a.Get("arm"), b.Get("arm"))) continue;
    findings->push_back(FindingAt(
        second, name, other,
        fmt::format("{} is {:.4g} m from the middle of the rotors here and {:.4g} m in {}", name,
                    other, one, first.Name())));
    squares += (one - other) * (one - other);
  }
  return std::sqrt(squares);
}

}  // namespace

void Place(const VehicleFile& file, const Reading* at, Contradicted* entry) {
  entry->file = file.files[at != nullptr ? at->file : 0]->path().string();
  if (at == nullptr) return;
  entry->line = at->leaf != nullptr ? at->leaf->place.line : 0;
  entry->key = at->key;
}

std::vector<std::pair<std::string, std::string>> ImpossibleInertia(const NeutralVehicle& v) {
  const std::array<const char*, 3> names = {"I_x", "I_y", "I_z"};
  std::vector<std::pair<std::string, std::string>> faults;
  for (const char* name : names) {
    if (v.States(name) && !(v.Get(name) > 0.0)) faults.emplace_back(name, kNotPositive);
  }
  if (!faults.empty() || !v.States("I_x") || !v.States("I_y") || !v.States("I_z")) return faults;
  for (std::size_t k = 0; k < 3; ++k) {
    const char *a = names[(k + 1) % 3], *b = names[(k + 2) % 3];
    const double own = v.Get(names[k]), others = v.Get(a) + v.Get(b);
    if (own <= others * (1.0 + kMeasured)) continue;
    faults.emplace_back(names[k],
                        fmt::format("no body has this inertia: {} = {:.4g} kg m^2 must be at most "
                                    "{} + {} = {:.4g}",
                                    names[k], own, a, b, others));
  }
  const std::array<std::array<const char*, 3>, 3> products = {
      {{"I_xy", "I_x", "I_y"}, {"I_xz", "I_x", "I_z"}, {"I_yz", "I_y", "I_z"}}};
  for (const auto& [product, a, b] : products) {
    if (std::abs(v.Get(product)) <= std::sqrt(v.Get(a) * v.Get(b))) continue;
    faults.emplace_back(product,
                        fmt::format("no body has this inertia: {} is larger than the root of {} {}",
                                    product, a, b));
  }
  return faults;
}

std::optional<Contradicted> NotPositive(const VehicleFile& file) {
  for (const Contradicted& finding : Checker(file).Run()) {
    if (finding.text == kNotPositive) return finding;
  }
  return std::nullopt;
}

std::vector<Contradicted> CheckVehicle(const VehicleFile& file) {
  std::vector<Contradicted> findings = Checker(file).Run();
  // A wrong mass or thrust makes others look wrong, which are named where they stay so with
  // whatever it may be. It is named itself where it explains others of two kinds.
  for (const Root& root : kRoots) {
    if (findings.empty() || !(ArmOf(file.vehicle) > 0.0)) break;
    if (!(root.for_arm(file.vehicle) > 0.0)) continue;
    const std::vector<Contradicted> left = LeftBeside(root, file, findings);
    std::set<std::string> kinds;
    std::string names;
    for (const Contradicted& finding : findings) {
      const std::string& name = finding.parameter;
      if (Names(left, name)) continue;
      kinds.insert(name.substr(0, name.find_first_of("xyz")));
      names += (names.empty() ? "" : ", ") + name;
    }
    const bool named = Names(findings, root.parameter);
    if (!named && kinds.size() < 2) continue;
    std::erase_if(findings, [&](const Contradicted& finding) {
      return finding.parameter != root.parameter && !Names(left, finding.parameter);
    });
    if (named) continue;
    findings.insert(findings.begin(),
                    FindingAt(file, root.parameter, file.vehicle.Get(root.parameter),
                              names + " do not go with it, and would with another"));
  }
  return findings;
}

std::vector<Contradicted> CompareVehicles(const std::vector<VehicleFile>& files) {
  std::vector<Contradicted> findings;
  for (std::size_t a = 0; a < files.size(); ++a) {
    for (std::size_t b = a + 1; b < files.size(); ++b) {
      const VehicleFile &first = files[a], &second = files[b];
      const bool same_file = first.files.front()->path() == second.files.front()->path();
      const std::string &x = first.vehicle.name, &y = second.vehicle.name;
      if (same_file || (!x.empty() && !y.empty() && x != y)) continue;
      const double centre = CompareCentres(first, second, &findings);
      for (const NeutralInfo& info : kNeutral) {
        const std::string name = info.name;
        if (name.starts_with("r_BM")) continue;
        const bool thrust = name == "k_f" || name == "k_m" || name == "full_speed";
        if (thrust && first.target->by_thrust != second.target->by_thrust) continue;
        const Reading *at = first.Find(name), *in = second.Find(name);
        if (at == nullptr || in == nullptr) continue;
        const double one = first.vehicle.Get(name), other = second.vehicle.Get(name);
        const auto same = [](double a_value, double b_value) {
          return std::abs(a_value - b_value) <=
                 kAgain * std::max(std::abs(a_value), std::abs(b_value));
        };
        // A number that differs only because another does is none.
        if (same(one, other) || same(one, in->Beside(first.vehicle))) continue;
        if (name.starts_with("I_") &&
            std::abs(one - other) <= first.vehicle.Get("m") * centre * centre) {
          continue;
        }
        findings.push_back(FindingAt(second, name, other,
                                     fmt::format("{} is {:.4g} {} here and {:.4g} in {}", name,
                                                 other, info.unit, one, first.Name())));
      }
    }
  }
  return findings;
}

}  // namespace trueline
