// Effects that the estimators' models lack, each declared once in the catalogue of effects.cc. An
// effect registers functions on stages of the simulation; stages without effects cost nothing.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/random.h"
#include "problems/simulation/config.h"
#include "problems/simulation/rotation.h"

namespace trueline::simulation {

// Air and rotor state at one instant.
struct Flow {
  double t;          // s, from the start of the log
  Vector3d v_B;      // m/s, air-relative velocity in body axes
  double thrust;     // m/s^2, specific thrust T, positive up
  double rotor_sum;  // rad/s, sum of the rotor speeds
  double height;     // m above the floor
  // For terms of the open catalogue.
  Vector3d ground_B = Vector3d::Zero();  // m/s, velocity over ground in body axes
  Vector3d w_B = Vector3d::Zero();       // rad/s
  Vector3d p_E = Vector3d::Zero();       // m
  Eigen::Matrix3d R_E_B = Eigen::Matrix3d::Identity();
};

// The body's true motion at one instant.
struct Motion {
  double t;           // s, from the start of the log
  double dt;          // s, since the last sample
  Quaterniond q_E_B;  // takes a vector in B to E
  Vector3d v_E;       // m/s
  Vector3d a_E;       // m/s^2, acceleration (not specific force)
  Vector3d w_B;       // rad/s
  Vector3d dw_B;      // rad/s^2
};

// Properties that change once in flight.
struct Load {
  double mass;   // kg
  Vector3d com;  // m, centre of mass from the origin of B
};

// The stages. Each function adds its part to the last argument.
struct Stages {
  template <class... Args>
  using Stage = std::vector<std::function<void(Args...)>>;

  Stage<double, Vector3d*> wind;               // t; w_E in m/s
  Stage<double, Vector3d*> drag;               // t; K in 1/s
  Stage<const Flow&, Vector3d*> force;         // specific force f_B in m/s^2
  Stage<const Flow&, Vector3d*> turn;          // angular acceleration in B, rad/s^2
  Stage<const Flow&, Vector3d*> moment;        // about the centre of mass, in B, N m
  Stage<const Flow&, int, double*> rotor;      // rotor's index; its thrust, as a multiple
  Stage<double, Load*> load;                   // t; mass and its centre
  Stage<Quaterniond*> thrust_axis;             // turns all rotors' axes in B
  Stage<double*> motor_lag;                    // s
  Stage<const Motion&, Vector3d*> at_imu;      // specific force where the IMU sits, in B
  Stage<Vector3d*> accel_scale;                // reading in I before its bias
  Stage<double, Vector3d*> accel_bias;         // t; m/s^2, in I
  Stage<const Motion&, Vector3d*> ahrs_error;  // angles (phi, theta, psi) of E' against E, rad
  Stage<double*> attitude_latency;             // s
  Stage<double*> fix_latency;                  // s
  Stage<int, Vector3d*> gate;                  // id; true place of the gate, m in E
  Stage<int, Random*, Vector3d*> false_gate;   // id; object detected as the gate, m in E
  Stage<Vector3d*> gate_vector;                // measured vector to the gate, m in B
};

// Calls every function of a stage.
template <class Functions, class... Args>
void Apply(const Functions& functions, Args&&... args) {
  for (const auto& function : functions) function(args...);
}

struct EffectParameter {
  std::string name;
  std::string unit;
  std::optional<double> fallback = std::nullopt;  // required where it has none
};

// Parameters of one effect by name.
class EffectValues {
 public:
  explicit EffectValues(const std::map<std::string, double>& values) : values_(values) {}
  double operator[](const std::string& name) const { return values_.at(name); }
  Vector3d Vector(const std::string& x, const std::string& y, const std::string& z) const {
    return {values_.at(x), values_.at(y), values_.at(z)};
  }

 private:
  const std::map<std::string, double>& values_;
};

struct EffectDefinition {
  std::string id;
  std::vector<EffectParameter> parameters;
  std::function<void(const EffectValues&, double gravity, Stages*)> add;
};

// Null for an unknown id.
const EffectDefinition* FindEffect(const std::string& id);

// One entry of `effects:`, {id: wind, w_x: 1, w_y: 0}. Throws InputError naming file, line and key.
Effect ReadEffect(const YamlMap& map);

// What a flight has for effects to act on.
struct Actors {
  std::vector<int> gates;  // ids of those that a camera sees; empty: there is no camera
  bool fixes = false;      // of any kind
  bool ahrs = false;
  int rotors = 0;
  bool above_floor = true;
};

// Why the effect would change nothing in such a flight, or has a value that means nothing; empty
// where it acts.
std::string WhyIdle(const Effect& effect, const Actors& flight);

// Appends the list under `effects:`. Throws InputError for an effect that is idle in this flight.
void ReadActingEffects(const YamlMap& map, const Actors& flight, std::vector<Effect>* effects);

// With the terms among them. Throws InputError for an unknown id or a missing or unknown parameter.
Stages StagesWith(const std::vector<Effect>& effects, double gravity);

}  // namespace trueline::simulation
