#include "problems/diagnosis/catalogue.h"

#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <set>

namespace trueline {
namespace {

constexpr char kFasterAndSlower[] = "fly the same straights slowly and fast, and hover between";
constexpr char kBothWays[] = "fly each straight in both directions and hover at several headings";
constexpr char kSpeedsAndGates[] = "pass gates of several headings at several speeds";

std::vector<EffectInfo> MakeCatalogue() {
  using enum EntersAt;
  return {
      {"quadratic_drag",
       kForce,
       {{"c", "1/m", 0.02, 1.0, 0.02, false}},
       "parasitic drag of frame and body grows with the square of air speed",
       kFasterAndSlower},
      {"rotor_drag",
       kForce,
       {{"k", "s/m", 0.005, 0.3, 0.004, false}},
       "induced drag of the rotors grows with thrust as well as with speed",
       "brake and turn hard at one speed, so that thrust changes while speed does not"},
      {"wind",
       kForce,
       {{"w_x", "m/s", 0.1, 8.0, 0.03}, {"w_y", "m/s", 0.1, 8.0, 0.03}},
       "the air moves over ground, so that drag acts on another velocity than the fixes show",
       kBothWays},
      {"drag_step",
       kForce,
       {{"factor", "1", 0.05, 5.0, 0.03, true, 1.0}},
       "drag changes once in flight: a part lost, caught or damaged",
       "repeat the first lap at the end at the same speed"},
      {"accel_scale_z",
       kAccelerometer,
       {{"s", "1", 0.01, 0.5, 0.005}},
       "the accelerometer's thrust axis reads too much by a constant factor",
       "climb, dive and turn hard, so that thrust leaves its hover value"},
      {"accel_bias_drift",
       kAccelerometer,
       {{"d", "m/s^3", 0.001, 0.1, 1e-4}},
       "the bias of the accelerometer's thrust axis drifts, as it does while it warms up",
       "repeat the first lap at the end"},
      {"imu_lever_arm",
       kAccelerometer,
       {{"r_x", "m", 0.01, 0.3, 0.003},
        {"r_y", "m", 0.01, 0.3, 0.003},
        {"r_z", "m", 0.01, 0.3, 0.003}},
       "an IMU off the centre of mass reads the turning of the body as acceleration",
       "turn and flip at high rates without gaining speed"},
      {"ahrs_acceleration_error",
       kAttitude,
       {{"k", "1/s", 0.1, 3.0, 0.01, false}},
       "the attitude filter mistakes acceleration for gravity, so its tilt error follows it",
       "hold an acceleration for several seconds, and then a speed"},
      {"tilt_scale",
       kAttitude,
       {{"s", "1", 0.01, 0.5, 0.01}},
       "the attitude filter states a tilt that is too large by a constant factor",
       "turn hard between gates whose distance from each other is known well"},
      {"heading_drift",
       kAttitude,
       {{"d", "rad/s", 0.001, 0.05, 2.5e-4}},
       "the heading of the attitude filter drifts: a gyro bias about z",
       "repeat the first lap at the end"},
      {"heading_distortion",
       kAttitude,
       {{"a_sin", "rad", 0.01, 0.5, 0.006}, {"a_cos", "rad", 0.01, 0.5, 0.006}},
       "magnetic fields of the vehicle deflect the compass by an angle that depends on heading",
       "pass gates of many headings"},
      {"attitude_latency",
       kAttitude,
       {{"tau", "s", 0.005, 0.2, 0.003, false}},
       "the logged attitude is older than its stamp",
       "roll and pitch quickly"},
      {"fix_latency",
       kFix,
       {{"tau", "s", 0.005, 0.25, 0.004, false}},
       "fixes are stamped later than their picture was taken",
       kSpeedsAndGates},
      {"fix_scale",
       kFix,
       {{"s", "1", 0.01, 0.5, 0.005}},
       "distances to gates are too long by a constant factor: wrong gate size or focal length",
       "see gates from far and near, at several speeds"},
      {"camera_misalignment",
       kFix,
       {{"roll", "rad", 0.01, 0.3, 0.003},
        {"pitch", "rad", 0.01, 0.3, 0.003},
        {"yaw", "rad", 0.01, 0.3, 0.003}},
       "the camera's orientation differs from its calibration",
       "see gates from far and near, off the middle of the picture too"},
      {"gate_moved",
       kFix,
       {{"dx", "m", 0.02, 2.0, 0.02}, {"dy", "m", 0.02, 2.0, 0.02}, {"dz", "m", 0.02, 2.0, 0.02}},
       "a gate is not at its place on the map",
       "pass the gate in both directions"},
      {"false_gate",
       kFix,
       {{"fraction", "1", 0.01, 0.9, 0.01, false}},
       "a share of the fixes is of another object than a gate",
       "look at the pictures of the outlying fixes"},
  };
}

// The gate numbers that occur in fixes.
std::set<int> GatesSeen(const FlightLog& log) {
  std::set<int> gates;
  for (const Fix& fix : log.fixes) {
    if (fix.gate >= 0) gates.insert(fix.gate);
  }
  return gates;
}

bool Applies(const EffectInfo& info, const FlightLog& log, const CandidateScope& scope) {
  if (info.enters == EntersAt::kAttitude && !scope.attitude) return false;
  if (info.enters == EntersAt::kAccelerometer && !scope.accelerometer) return false;
  // Without the accelerometer's x and y a wind cannot be distinguished from a tilt of E'.
  if (info.id == "wind" && !scope.drag_measured) return false;
  const bool needs_map = info.id == "fix_scale" || info.id == "camera_misalignment";
  if (needs_map && log.gates.empty()) return false;
  return info.enters != EntersAt::kFix || !GatesSeen(log).empty();
}

}  // namespace

const std::vector<EffectInfo>& Catalogue() {
  static const std::vector<EffectInfo> catalogue = MakeCatalogue();
  return catalogue;
}

const EffectInfo& InfoOf(const std::string& id) {
  const auto& catalogue = Catalogue();
  const auto it = std::find_if(catalogue.begin(), catalogue.end(),
                               [&](const EffectInfo& info) { return info.id == id; });
  CHECK(it != catalogue.end()) << "no effect is called " << id;
  return *it;
}

std::string NameOf(EntersAt enters) {
  switch (enters) {
    case EntersAt::kForce:
      return "force";
    case EntersAt::kAttitude:
      return "attitude";
    case EntersAt::kAccelerometer:
      return "accelerometer";
    case EntersAt::kThrust:
      return "thrust";
    case EntersAt::kLoad:
      return "load";
    case EntersAt::kFix:
      break;
  }
  return "fix";
}

Effect Candidate::At(const Eigen::VectorXd& parameters) const {
  Effect effect{info->id, fixed};
  for (std::size_t i = 0; i < info->parameters.size(); ++i) {
    effect.values[info->parameters[i].name] = parameters[static_cast<int>(i)];
  }
  return effect;
}

Eigen::VectorXd Candidate::Neutral() const {
  Eigen::VectorXd neutral(info->parameters.size());
  for (int i = 0; i < neutral.size(); ++i) neutral[i] = info->parameters[i].neutral;
  return neutral;
}

Eigen::VectorXd Candidate::Ordinary() const {
  Eigen::VectorXd ordinary(info->parameters.size());
  for (int i = 0; i < ordinary.size(); ++i) ordinary[i] = info->parameters[i].ordinary;
  return ordinary;
}

std::string Candidate::Label() const {
  if (fixed.count("gate") > 0) return fmt::format("{} {}", info->id, fixed.at("gate"));
  if (fixed.count("rotor") > 0) return fmt::format("{} {}", info->id, fixed.at("rotor"));
  if (fixed.count("t_step") > 0) return fmt::format("{} {:.1f} s", info->id, fixed.at("t_step"));
  return info->id;
}

std::vector<Candidate> CandidatesFor(const FlightLog& log, const CandidateScope& scope) {
  constexpr int kSteps = 12;  // times tried for a step effect; a refit refines the best one
  std::vector<Candidate> candidates;
  for (const EffectInfo& info : Catalogue()) {
    if (!Applies(info, log, scope) || info.id == "false_gate") continue;
    if (info.id == "gate_moved") {
      const std::set<int> gates = GatesSeen(log);
      // With a single gate, moving it only moves the origin.
      if (gates.size() < 2) continue;
      for (const int gate : gates) candidates.push_back({&info, {{"gate", gate}}});
    } else if (info.id == "drag_step") {
      for (int k = 1; k <= kSteps; ++k) {
        candidates.push_back({&info, {{"t_step", scope.duration * k / (kSteps + 1)}}});
      }
    } else {
      candidates.push_back({&info, {}});
    }
  }
  return candidates;
}

}  // namespace trueline
