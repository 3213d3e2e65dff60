#include "problems/simulators/check_vehicle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

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
constexpr Range kGyration = {"I", "radius of gyration over the arm", 0.25, 1.1,
                             "multirotors from 27 g to 2 kg have 0.4 to 0.7 in roll and pitch"};
constexpr Range kGyrationYaw = {"I_z", "radius of gyration over the arm", 0.35, 1.5,
                                "multirotors from 27 g to 2 kg have 0.6 to 1.0 in yaw"};
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

// `v` with a mass that is usual for its arm. What is stated by mass follows.
NeutralVehicle WithUsualMass(NeutralVehicle v) {
  constexpr double kUsual = 170.0;  // kg/m^3, over the cube of the arm
  const double ratio = kUsual * std::pow(ArmOf(v), 3) / v.Get("m");
  v.body["m"] *= ratio;
  for (const NeutralInfo& info : kNeutral) {
    const std::string_view meaning = info.meaning;
    const bool by_mass = meaning.ends_with("by mass") || meaning.ends_with("and mass");
    if (by_mass && v.States(info.name)) v.body[info.name] /= ratio;
  }
  return v;
}

// `v` with k_f in its right unit, or as is usual for its arm.
NeutralVehicle WithUsualThrust(NeutralVehicle v) {
  const double ratio = ThrustForArm(v), unit = OtherUnit(ratio);
  const double usual = std::sqrt(kThrustForArm.low * kThrustForArm.high);
  for (Numbers& rotor : v.rotors) rotor["k_f"] *= unit != 1.0 ? unit : usual / ratio;
  return v;
}

class Checker {
 public:
  explicit Checker(const VehicleFile& file) : file_(file), v_(file.vehicle) {}

  std::vector<FileFinding> Run() {
    Inertia();
    Flatness();
    Sizes();
    Rotors();
    Motors();
    Drag();
    Repeated();
    return findings_;
  }

 private:
  void Add(const std::string& parameter, double value, const std::string& text,
           const Reading* at = nullptr) {
    FileFinding finding;
    finding.parameter = parameter;
    const NeutralInfo* info = FindNeutral(parameter);
    finding.unit = info != nullptr ? info->unit : "";
    finding.value = value;
    finding.text = text;
    if (at == nullptr) at = file_.Find(parameter);
    finding.file = file_.files.front()->path().string();
    if (at != nullptr) {
      finding.file = file_.files[at->file]->path().string();
      finding.line = at->leaf != nullptr ? at->leaf->place.line : 0;
      finding.key = at->key;
    }
    findings_.push_back(finding);
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
    const std::array<const char*, 3> names = {"I_x", "I_y", "I_z"};
    if (!v_.States("I_x") || !v_.States("I_y") || !v_.States("I_z")) return;
    for (std::size_t k = 0; k < 3; ++k) {
      const double own = v_.Get(names[k]);
      const double others = v_.Get(names[(k + 1) % 3]) + v_.Get(names[(k + 2) % 3]);
      if (own > 0.0 && own <= others * (1.0 + kMeasured)) continue;
      Add(names[k], own,
          fmt::format("no body has this inertia: {} = {:.4g} kg m^2 must be positive and at most "
                      "{} + {} = {:.4g}",
                      names[k], own, names[(k + 1) % 3], names[(k + 2) % 3], others));
    }
    const std::array<std::array<const char*, 3>, 3> products = {
        {{"I_xy", "I_x", "I_y"}, {"I_xz", "I_x", "I_z"}, {"I_yz", "I_y", "I_z"}}};
    for (const auto& [product, a, b] : products) {
      if (std::abs(v_.Get(product)) <= std::sqrt(std::abs(v_.Get(a) * v_.Get(b)))) continue;
      Add(product, v_.Get(product),
          fmt::format("no body has this inertia: {} is larger than the root of {} {}", product, a,
                      b));
    }
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
    if (mass > 0.0) Within(kMassForArm, "m", mass / std::pow(arm, 3));
    for (const char* axis : {"I_x", "I_y", "I_z"}) {
      if (!(mass > 0.0) || !(v_.Get(axis) > 0.0)) continue;
      Within(axis[2] == 'z' ? kGyrationYaw : kGyration, axis, std::sqrt(v_.Get(axis) / mass) / arm,
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
    const std::vector<FixedRotor>& order = file_.target->order;
    for (std::size_t i = 0; i < std::min(n, order.size()); ++i) {
      const double along = v_.rotors[i].at("x") * order[i].x,
                   across = v_.rotors[i].at("y") * order[i].y;
      if (along + across * Mirror(v_, order) > 0.0) continue;
      Add("x", v_.rotors[i].at("x"),
          fmt::format("rotor {} stands elsewhere than the simulator's code assumes ({} {})", i,
                      order[i].x > 0 ? "front" : "rear", order[i].y > 0 ? "right" : "left"));
      break;
    }
  }

  void Motors() {
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
      if (std::ranges::find(findings_, name, &FileFinding::parameter) != findings_.end()) continue;
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
  std::vector<FileFinding> findings_;
};

}  // namespace

std::vector<FileFinding> CheckVehicle(const VehicleFile& file) {
  std::vector<FileFinding> findings = Checker(file).Run();
  const auto names = [](const std::vector<FileFinding>& all, const std::string& parameter) {
    return std::ranges::find(all, parameter, &FileFinding::parameter) != all.end();
  };
  // A wrong mass or thrust makes others look wrong, which are named where they stay so without it.
  for (const auto& [parameter, usual] :
       {std::pair{"m", &WithUsualMass}, std::pair{"k_f", &WithUsualThrust}}) {
    if (!names(findings, parameter)) continue;
    VehicleFile changed = file;
    changed.vehicle = usual(file.vehicle);
    const std::vector<FileFinding> left = Checker(changed).Run();
    std::erase_if(findings, [&, root = std::string(parameter)](const FileFinding& finding) {
      return finding.parameter != root && !names(left, finding.parameter);
    });
  }
  return findings;
}

namespace {

// Files have origins of their own: where the centre of mass stands between the rotors is compared.
void CompareCentres(const VehicleFile& first, const VehicleFile& second,
                    std::vector<FileFinding>* findings) {
  constexpr double kSameCentre = 0.05;  // of the arm
  const NeutralVehicle &a = first.vehicle, &b = second.vehicle;
  if (!a.Flies() || !b.Flies()) return;
  for (const char* name : {"r_BM_x", "r_BM_y", "r_BM_z"}) {
    const int axis = name[5] - 'x';
    const double one = a.CentreFromRotors(axis), other = b.CentreFromRotors(axis);
    if (std::abs(one - other) <= kSameCentre * std::max(a.Get("arm"), b.Get("arm"))) continue;
    const Reading* in = second.Find(name);
    findings->push_back(
        {name, "m", other,
         fmt::format("{} is {:.4g} m from the middle of the rotors here and {:.4g} m in {}", name,
                     other, one, first.Name()),
         second.files[in != nullptr ? in->file : 0]->path().string(),
         in != nullptr && in->leaf != nullptr ? in->leaf->place.line : 0,
         in != nullptr ? in->key : ""});
  }
}

}  // namespace

std::vector<FileFinding> CompareVehicles(const std::vector<VehicleFile>& files) {
  std::vector<FileFinding> findings;
  for (std::size_t a = 0; a < files.size(); ++a) {
    for (std::size_t b = a + 1; b < files.size(); ++b) {
      const VehicleFile &first = files[a], &second = files[b];
      const bool same_file = first.files.front()->path() == second.files.front()->path();
      const std::string &x = first.vehicle.name, &y = second.vehicle.name;
      if (same_file || (!x.empty() && !y.empty() && x != y)) continue;
      CompareCentres(first, second, &findings);
      for (const NeutralInfo& info : kNeutral) {
        const std::string name = info.name;
        if (name.starts_with("r_BM")) continue;
        const bool thrust = name == "k_f" || name == "k_m" || name == "full_speed";
        if (thrust && first.target->by_thrust != second.target->by_thrust) continue;
        const Reading *at = first.Find(name), *in = second.Find(name);
        if (at == nullptr || in == nullptr) continue;
        const double one = first.vehicle.Get(name), other = second.vehicle.Get(name);
        if (std::abs(one - other) <= kAgain * std::max(std::abs(one), std::abs(other))) continue;
        FileFinding finding{name,
                            info.unit,
                            other,
                            "",
                            second.files[in->file]->path().string(),
                            in->leaf != nullptr ? in->leaf->place.line : 0,
                            in->key};
        finding.text = fmt::format("{} is {:.4g} {} here and {:.4g} in {}", name, other, info.unit,
                                   one, first.Name());
        findings.push_back(finding);
      }
    }
  }
  return findings;
}

}  // namespace trueline
