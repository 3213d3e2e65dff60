#include "problems/rotor_simulation/simulate_rotor_flight.h"

#include <cmath>

#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/common/yaml_options.h"
#include "problems/rotor_simulation/navigator.h"
#include "problems/rotor_simulation/trajectory_tracker.h"
#include "problems/simulation/effects.h"
#include "problems/simulation/imu.h"

namespace trueline {
namespace {

using simulation::BodyRate;
using simulation::BodyState;
using simulation::RotorArray;
using Model = RotorDrivenModel;
using Eigen::Vector3d;

constexpr int kSubsteps = 4;   // of the physics in an IMU period
constexpr double kLost = 2.0;  // m from the trajectory

Vector3d Parameter(const RotorSimulation& config, int index) {
  return Eigen::Map<const Vector3d>(config.vehicle.parameters.data() + index);
}

// The airframe's body origin B is the centre of mass.
simulation::VehicleConfig MakeVehicle(const RotorSimulation& config) {
  simulation::VehicleConfig vehicle;
  vehicle.mass = config.vehicle.parameters[Model::kMass];
  vehicle.inertia = Parameter(config, Model::kInertia);
  for (const RotorSpec& rotor : config.vehicle.model.rotors()) {
    vehicle.rotors.push_back({rotor.position - Parameter(config, Model::kCentre), rotor.axis,
                              rotor.spin, rotor.k_f, rotor.k_m});
  }
  vehicle.motor_lag = config.motor_lag;
  vehicle.max_rotor_speed = config.limits.max_speed;
  vehicle.drag = config.drag;
  return vehicle;
}

simulation::Stages MakeStages(const RotorSimulation& config) {
  std::vector<simulation::EffectSetting> effects = config.effects;
  const Vector3d arm = Parameter(config, Model::kImuArm) - Parameter(config, Model::kCentre);
  effects.push_back({"imu_lever_arm", {{"r_x", arm.x()}, {"r_y", arm.y()}, {"r_z", arm.z()}}});
  return simulation::HangEffects(effects, config.vehicle.model.gravity());
}

simulation::ImuConfig MakeImu(const RotorSimulation& config) {
  simulation::ImuConfig imu;
  imu.rate = config.imu_rate;
  imu.accel_noise_density = config.noise.accel / std::sqrt(config.imu_rate);
  imu.gyro_noise_density = config.noise.gyro / std::sqrt(config.imu_rate);
  imu.accel_bias = Parameter(config, Model::kAccelBias);
  imu.gyro_bias = Parameter(config, Model::kGyroBias);
  return imu;
}

simulation::NavigatorConfig MakeNavigator(const RotorSimulation& config) {
  simulation::NavigatorConfig navigator;
  navigator.gravity = config.vehicle.model.gravity();
  navigator.accel_bias = Parameter(config, Model::kAccelBias);
  navigator.gyro_bias = Parameter(config, Model::kGyroBias);
  navigator.pose_arm = Parameter(config, Model::kPoseArm) - Parameter(config, Model::kCentre);
  return navigator;
}

PiecewisePolynomial Raised(const PiecewisePolynomial& path, double height) {
  std::vector<FlatMatrix> pieces = path.coefficients();
  for (FlatMatrix& piece : pieces) piece(2, 0) -= height;
  return {path.breaks(), pieces};
}

// Vehicle, air and sensors, stepped together from one IMU sample to the next.
class TrackedFlight {
 public:
  TrackedFlight(const RotorSimulation& config, const PiecewisePolynomial& path, std::uint64_t seed)
      : config_(config),
        period_(1.0 / config.imu_rate),
        stages_(MakeStages(config)),
        airframe_(MakeVehicle(config), config.vehicle.model.gravity(), stages_),
        tracker_(RotorFlight(config.vehicle, Raised(path, config.height)),
                 config.vehicle.model.gravity(), period_,
                 (1.0 - config.control_margin) * config.limits.min_speed,
                 (1.0 + config.control_margin) * config.limits.max_speed, config.motor_lag),
        imu_(MakeImu(config), config.vehicle.model.num_rotors(), seed, stages_),
        force_(seed, "force"),
        twist_(seed, "twist"),
        pose_(seed, "pose"),
        battery_(seed, "battery"),
        state_(tracker_.Start()),
        navigator_(MakeNavigator(config), state_) {}

  int num_samples() const { return tracker_.num_steps(); }

  // Records sample `k` in log and truth, then integrates to the next with command and disturbances
  // held.
  void Step(int k, FlightLog* log, RotorTruth* truth) {
    const double t = k * period_, root_rate = std::sqrt(config_.imu_rate);
    const Vector3d gust_B = config_.noise.force_density * root_rate * force_.NormalVector3();
    const Vector3d twist_B = config_.noise.angular_density * root_rate * twist_.NormalVector3();
    const Vector3d gust_E = state_.Attitude() * gust_B;
    // Specific force and rates do not depend on the new command: it acts from now on.
    const BodyRate now = airframe_.Rate(t, state_, state_.rotors, gust_E, twist_B);
    const auto reading =
        imu_.Sample({t, period_, state_.Attitude(), now.rate.v_E, state_.w_B, now.rate.w_B},
                    now.f_B, state_.rotors);
    log->imu.push_back({FromSeconds(t), reading.accel, reading.gyro});
    if (IsPoseSample(k)) LogPose(t, log);
    const RotorArray command = tracker_.Command(k, navigator_.state());
    navigator_.Add(reading, period_);
    if (config_.log_rotors) LogSpeeds(t, config_.log_commands ? command : state_.rotors, log);
    const RotorArray settled = config_.motors ? DriveMotors(k, command, log) : command;
    Note(k, truth);
    for (int j = 0; j < kSubsteps; ++j) {
      const double h = period_ / kSubsteps;
      state_ = airframe_.Step(t + j * h, h, state_, settled, gust_E, twist_B);
    }
  }

 private:
  // True for the sample nearest to each of the camera's times.
  bool IsPoseSample(int k) const {
    const double share = config_.pose_rate / config_.imu_rate;
    return k == 0 || std::floor(k * share + 0.5) > std::floor((k - 1) * share + 0.5);
  }
  void LogSpeeds(double t, const RotorArray& speeds, FlightLog* log) const {
    log->rotors.push_back({FromSeconds(t), {speeds.begin(), speeds.end()}});
  }
  // Speeds that the motors reach for the wanted ones; logs commands, and the battery at its rate.
  RotorArray DriveMotors(int k, const RotorArray& wanted, FlightLog* log) {
    const simulation::MotorDrive drive(*config_.motors);
    const double t = k * period_;
    const RotorArray command = drive.CommandFor(wanted);
    log->motors.push_back({FromSeconds(t), {command.begin(), command.end()}});
    const double share = config_.motors->battery_rate * period_;
    if (k == 0 || std::floor(k * share) > std::floor((k - 1) * share)) {
      const double error = config_.motors->battery_sigma * battery_.Normal();
      log->battery.push_back({FromSeconds(t), drive.Voltage(t, command) + error});
    }
    return drive.SettledSpeed(t, command);
  }
  void LogPose(double t, FlightLog* log) {
    const Vector3d arm = Parameter(config_, Model::kPoseArm) - Parameter(config_, Model::kCentre);
    const Vector3d shift = config_.noise.position * pose_.NormalVector3();
    const Vector3d turn = config_.noise.attitude * pose_.NormalVector3();
    log->pose.push_back({FromSeconds(t), state_.p_E + state_.Attitude() * arm + shift,
                         state_.Attitude() * simulation::RotationByVector(turn)});
    navigator_.AddPose(log->pose.back().p_E, log->pose.back().q_E);
  }
  void Note(int k, RotorTruth* truth) const {
    const double error = (tracker_.PositionAt(k) - state_.p_E).norm();
    if (!(error < kLost)) {
      throw InputError(fmt::format(
          "the vehicle lost the trajectory after {:.2f} s; fly a gentler one, or lower the "
          "disturbances and effects",
          k * period_));
    }
    const Eigen::Quaterniond q = state_.Attitude();
    RotorNode node;
    node << q.w(), q.x(), q.y(), q.z(), state_.p_E, state_.v_E, state_.w_B;
    truth->states.push_back(node);
    truth->path_error_rms += error * error;
  }

  const RotorSimulation& config_;
  double period_;
  simulation::Stages stages_;
  simulation::Airframe airframe_;
  simulation::TrajectoryTracker tracker_;
  simulation::Imu imu_;
  Random force_, twist_, pose_, battery_;
  BodyState state_;
  simulation::Navigator navigator_;
};

}  // namespace

FlightLog SimulateRotorFlight(const RotorSimulation& config, const PiecewisePolynomial& path,
                              std::uint64_t seed, RotorTruth* truth) {
  FlightLog log;
  log.name = "rotor_flight";
  log.gravity = config.vehicle.model.gravity();
  log.vehicle = Vehicle{config.vehicle.parameters[Model::kMass], {}};
  for (const RotorSpec& r : config.vehicle.model.rotors()) {
    log.vehicle->rotors.push_back({r.position, r.axis, r.spin, r.k_f, r.k_m});
  }
  RotorTruth own;
  RotorTruth* noted = truth != nullptr ? truth : &own;
  *noted = RotorTruth();
  for (int i = Model::kMoving; i < Model::kStates; ++i) {
    noted->constants[i - Model::kMoving] = config.vehicle.parameters[i];
  }
  TrackedFlight flight(config, path, seed);
  const int samples = flight.num_samples();
  for (int k = 0; k < samples; ++k) flight.Step(k, &log, noted);
  noted->path_error_rms = std::sqrt(noted->path_error_rms / std::max(1, samples));
  return log;
}

namespace {

simulation::MotorDriveConfig ReadMotorDrive(const YamlMap& map) {
  simulation::MotorDriveConfig drive;
  ReadPositive(map, "full_speed", &drive.full_speed);
  ReadPositive(map, "nominal_voltage", &drive.nominal_voltage);
  ReadNotNegative(map, "idle", &drive.idle);
  if (drive.idle >= 1.0) map.Fail("idle", "is a share of full_speed, below 1");
  ReadNotNegative(map, "voltage", &drive.voltage);
  ReadPositive(map, "battery", &drive.battery);
  ReadNotNegative(map, "drop", &drive.drop);
  ReadNotNegative(map, "sag", &drive.sag);
  ReadNotNegative(map, "battery_sigma", &drive.battery_sigma);
  ReadPositive(map, "battery_rate", &drive.battery_rate);
  map.Finish();
  return drive;
}

}  // namespace

void ReadRotorSimulation(const YamlMap& map, RotorSimulation* config) {
  config->imu_rate = map.Get<double>("imu_rate", config->imu_rate);
  config->pose_rate = map.Get<double>("pose_rate", config->pose_rate);
  config->height = map.Get<double>("height", config->height);
  if (!(config->height >= 0.0)) map.Fail("height", "must be 0 m or more");
  if (!(config->imu_rate >= 50.0)) map.Fail("imu_rate", "must be 50 Hz or more");
  if (!(config->pose_rate > 0.0 && config->pose_rate <= config->imu_rate)) {
    map.Fail("pose_rate", "must be above 0 and at most imu_rate");
  }
  ReadRotorNoise(map.ChildOrEmpty("noise"), &config->noise);
  config->drag = map.GetVector3("drag", config->drag);
  config->motor_lag = map.Get<double>("motor_lag", config->motor_lag);
  if (!(config->motor_lag > 0.0)) map.Fail("motor_lag", "must be above 0 s");
  config->log_commands = map.Get<bool>("log_commands", config->log_commands);
  if (map.Has("motors")) config->motors = ReadMotorDrive(map.Child("motors"));
  config->log_rotors = map.Get<bool>("log_rotors", config->log_rotors);
  if (!config->log_rotors && !config->motors) {
    map.Fail("log_rotors", "leaves nothing of the rotors in the log; state `motors` too");
  }
  for (const YamlMap& entry : map.Children("effects")) {
    simulation::EffectSetting effect;
    for (const std::string& key : entry.Keys()) {
      if (key == "id") continue;
      effect.values[key] = entry.Get<double>(key);
    }
    effect.id = entry.Get<std::string>("id");
    entry.Finish();
    if (effect.id == "ground_effect" && config->height == 0.0) {
      entry.Fail("id", "needs a height above the floor; set simulation: {height: ...}");
    }
    config->effects.push_back(effect);
  }
  simulation::HangEffects(config->effects, 9.81);  // throws for unknown effects before any flight
  map.Finish();
}

}  // namespace trueline
