#include "problems/rotor_diagnosis/rotor_catalogue.h"

#include <glog/logging.h>

#include <algorithm>

namespace trueline {
namespace {

constexpr int kSteps = 12;  // times tried for a step effect; the best is refined

constexpr char kFasterAndSlower[] =
    "fly the same lines slowly and fast, with climbs, and hover between";
constexpr char kSpeedsOfRotors[] =
    "fly at one speed with much and little thrust (turns, dives), so that rotor speeds change "
    "while "
    "air speed does not";
constexpr char kRepeat[] = "repeat the first manoeuvre at the end";
constexpr char kTurnEachAxis[] = "roll, pitch and yaw one after another, hard, and hover between";

std::vector<EffectInfo> MakeCatalogue() {
  using enum EntersAt;
  return {
      {"linear_drag",
       kForce,
       {{"K_x", "1/s", 0.1, 3.0, 0.02},
        {"K_y", "1/s", 0.1, 3.0, 0.02},
        {"K_z", "1/s", 0.1, 3.0, 0.02}},
       "the air brakes body and rotors in proportion to speed",
       kSpeedsOfRotors},
      {"thrust_sag",
       kThrust,
       {{"d", "1/s", 1e-3, 0.05, 5e-5}},
       "thrust at one rotor speed falls in flight: blades that wear or bend, air that warms up",
       kRepeat},
      {"rotor_loss",
       kThrust,
       {{"factor", "1", 0.05, 1.5, 0.003, false, 1.0}},
       "one rotor gives less thrust than the others at the same speed: a damaged or wrong "
       "propeller",
       kTurnEachAxis},
      {"rotor_inflow",
       kThrust,
       {{"k", "1", 1e-5, 1e-3, 4e-6}},
       "inflow from above unloads the rotors: thrust falls in a climb",
       kSpeedsOfRotors},
      {"rotor_speed_drag",
       kForce,
       {{"k", "1", 1e-5, 1e-3, 4e-6, false}},
       "blades flap and drag in the wind of flight, the more the faster they turn",
       kSpeedsOfRotors},
      {"motor_lag",
       kThrust,
       {{"tau", "s", 0.01, 0.3, 0.002, false}},
       "rotors.csv holds commands, or late readings, that the rotors follow with a lag",
       "change thrust and roll quickly and often"},
      {"translational_lift",
       kThrust,
       {{"k", "1/m", 0.01, 1.0, 0.002, false}},
       "rotors that move sideways meet more air: thrust grows with horizontal air speed",
       kFasterAndSlower},
      {"air_moment",
       kForce,
       {{"roll", "N s", 1e-5, 0.1, 1e-6}, {"pitch", "N s", 1e-5, 0.1, 1e-6}},
       "air speed gives a moment: drag acts above or below the centre of mass, and "
       "blades that flap lift the side that meets the wind",
       kFasterAndSlower},
      {"ground_effect",
       kThrust,
       {{"k", "m", 0.1, 0.6, 0.02, false}},
       "near the floor the rotors' downwash is blocked: thrust grows",
       "hover low and high"},
      {"payload_step",
       kLoad,
       {{"mass", "kg", 0.01, 3.0, 3e-4}},
       "mass is picked up or dropped in flight",
       kRepeat},
      {"com_step",
       kLoad,
       {{"dx", "m", 0.002, 0.1, 1e-4}, {"dy", "m", 0.002, 0.1, 1e-4}},
       "the centre of mass moves in flight: a battery or load that slips",
       kRepeat},
      {"rotor_tilt",
       kThrust,
       {{"roll", "rad", 0.01, 0.3, 0.002}, {"pitch", "rad", 0.01, 0.3, 0.002}},
       "the rotors' thrust is not along the body's z axis: bent arms, or a turned IMU",
       kTurnEachAxis},
  };
}

// Lowest height of the flight above the floor (p_z = 0), m.
double LowestHeight(const RotorData& data) {
  double lowest = -data.poses.front().p_E.z();
  for (const RotorPose& pose : data.poses) lowest = std::min(lowest, -pose.p_E.z());
  return lowest;
}

bool InBase(const RotorPrior& prior, const std::string& constant) {
  return prior.sigma[FindRotorConstant(constant)] > 0.0;
}

bool Applies(const std::string& id, const RotorData& data, const RotorPrior& prior) {
  constexpr double kOnTheFloor = 0.02;  // m
  if (id == "linear_drag") return !InBase(prior, "K_x") && !InBase(prior, "K_z");
  if (id == "rotor_inflow") return !InBase(prior, "inflow");
  if (id == "motor_lag") return !data.motors;  // with commands the base fit estimates it
  return id != "ground_effect" || LowestHeight(data) > kOnTheFloor;
}

double Length(const RotorData& data) { return data.poses.back().t - data.poses.front().t; }

}  // namespace

const std::vector<EffectInfo>& RotorCatalogue() {
  static const std::vector<EffectInfo> catalogue = MakeCatalogue();
  return catalogue;
}

const EffectInfo& RotorInfoOf(const std::string& id) {
  const auto& catalogue = RotorCatalogue();
  const auto it = std::find_if(catalogue.begin(), catalogue.end(),
                               [&](const EffectInfo& info) { return info.id == id; });
  CHECK(it != catalogue.end()) << "no effect is called " << id;
  return *it;
}

bool EntersSquared(const EffectInfo& info) { return info.id == "ground_effect"; }

bool IsStep(const Candidate& candidate) { return candidate.fixed.count("t_step") > 0; }

double StepSpacing(const RotorData& data) { return Length(data) / (kSteps + 1); }

std::vector<Candidate> RotorCandidatesFor(const RotorData& data, int rotors,
                                          const RotorPrior& prior) {
  std::vector<Candidate> candidates;
  for (const EffectInfo& info : RotorCatalogue()) {
    if (!Applies(info.id, data, prior)) continue;
    if (info.id == "rotor_loss") {
      for (int i = 0; i < rotors; ++i) candidates.push_back({&info, {{"rotor", i}}});
    } else if (info.id.ends_with("_step")) {
      const double start = data.since_start + data.poses.front().t;
      for (int k = 1; k <= kSteps; ++k) {
        candidates.push_back({&info, {{"t_step", start + k * StepSpacing(data)}}});
      }
    } else {
      candidates.push_back({&info, {}});
    }
  }
  return candidates;
}

std::vector<Candidate> StepsAround(const Candidate& candidate, double range, int count) {
  std::vector<Candidate> candidates;
  for (int k = 0; k < count; ++k) {
    const double shift = range * (2.0 * k / (count - 1) - 1.0);
    candidates.push_back({candidate.info, {{"t_step", candidate.fixed.at("t_step") + shift}}});
  }
  return candidates;
}

}  // namespace trueline
