#include "problems/simulation/simulate_rotor_flight.h"

#include <cmath>

#include "cost_functions/models/rigid_body.h"
#include "problems/common/error.h"
#include "problems/common/random.h"
#include "problems/simulation/flight.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/streams.h"
#include "problems/simulation/trajectory_tracker.h"
#include "problems/trajectory/trajectory_config.h"

namespace trueline {
namespace {

using simulation::BodyState;
using simulation::Instant;
using simulation::RotorArray;
using Model = RotorDrivenModel;
using Eigen::Vector3d;

constexpr double kLost = 2.0;  // m from the trajectory

Vector3d Parameter(const RotorSimulation& config, int index) {
  return Eigen::Map<const Vector3d>(config.vehicle.parameters.data() + index);
}

// The airframe's body origin B is the centre of mass.
simulation::VehicleConfig MakeVehicle(const RotorSimulation& config) {
  simulation::VehicleConfig vehicle;
  vehicle.mass = config.vehicle.parameters[Model::kMass];
  vehicle.inertia = Parameter(config, Model::kInertia);
  for (const Rotor& rotor : config.vehicle.model.rotors()) {
    vehicle.rotors.push_back({rotor.position - Parameter(config, Model::kCentre), rotor.axis,
                              rotor.spin, rotor.k_f, rotor.k_m});
  }
  vehicle.motor_lag = config.motor_lag;
  vehicle.rotor_inertia = config.rotor_inertia;
  vehicle.max_rotor_speed = config.limits.max_speed;
  vehicle.drag = config.drag;
  vehicle.blades = config.blades;
  return vehicle;
}

simulation::Stages MakeStages(const RotorSimulation& config) {
  std::vector<Effect> effects = config.effects;
  const Vector3d arm = Parameter(config, Model::kImuArm) - Parameter(config, Model::kCentre);
  effects.push_back({"imu_lever_arm", {{"r_x", arm.x()}, {"r_y", arm.y()}, {"r_z", arm.z()}}});
  return simulation::StagesWith(effects, config.vehicle.model.gravity());
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

simulation::FlightSetup MakeSetup(const RotorSimulation& config) {
  simulation::FlightSetup setup;
  setup.vehicle = MakeVehicle(config);
  setup.imu = MakeImu(config);
  setup.gravity = config.vehicle.model.gravity();
  setup.stages = MakeStages(config);
  setup.substeps = 4;
  setup.time = [period = 1.0 / config.imu_rate](int k) { return k * period; };
  return setup;
}

// True for one sample out of 1 / share: the first one after each due time, or the nearest to it
// with a `phase` of 0.5.
bool IsDue(int k, double share, double phase) {
  return k == 0 || std::floor(k * share + phase) > std::floor((k - 1) * share + phase);
}

ChannelsSample Channels(double t, const RotorArray& values) {
  return {FromSeconds(t), {values.begin(), values.end()}};
}

// Motors whose speed controller knows their curve at the nominal voltage but not the battery, whose
// voltage falls with charge and under load. Written independently of the estimators' motor model.
class MotorDrive {
 public:
  explicit MotorDrive(const simulation::MotorDriveConfig& config) : config_(config) {}

  // Commands (0 to 1) that give the rotors `speeds` (rad/s) at the nominal voltage.
  RotorArray CommandFor(const RotorArray& speeds) const {
    const RotorArray share = speeds / config_.full_speed;
    return ((share - config_.idle) / (1.0 - config_.idle)).max(0.0).min(1.0);
  }
  // V at time `t` (s) under these commands.
  double Voltage(double t, const RotorArray& command) const {
    return config_.battery - config_.drop * t - config_.sag * command.mean();
  }
  // Steady-state rotor speeds (rad/s).
  RotorArray SettledSpeed(double t, const RotorArray& command) const {
    const double strength =
        std::pow(Voltage(t, command) / config_.nominal_voltage, config_.voltage);
    const RotorArray turning = (command > 0.0).cast<double>();
    return turning * strength * config_.full_speed * (config_.idle * (1.0 - command) + command);
  }

 private:
  simulation::MotorDriveConfig config_;
};

// Flies along the trajectory by the vehicle's own sensors, and logs these and the motors.
class TrajectoryPilot {
 public:
  TrajectoryPilot(const RotorSimulation& config, const PiecewisePolynomial& path,
                  std::uint64_t seed, FlightLog* log)
      : config_(config),
        pose_arm_(Parameter(config, Model::kPoseArm) - Parameter(config, Model::kCentre)),
        tracker_(RotorFlight(config.vehicle, Raised(path, config.height)),
                 config.vehicle.model.gravity(), 1.0 / config.imu_rate,
                 (1.0 - config.control_margin) * config.limits.min_speed,
                 (1.0 + config.control_margin) * config.limits.max_speed, config.motor_lag),
        navigator_(MakeNavigator(config), Start()),
        pose_(seed, "pose"),
        battery_(seed, "battery"),
        counter_(seed, "rotor speeds"),
        log_(log) {}

  int num_samples() const { return tracker_.num_steps(); }
  BodyState Start() const { return tracker_.Start(); }
  const simulation::PathErrors& errors() const { return errors_; }

  RotorArray Command(const Instant& now) {
    NoteError(now);
    // The camera is triggered by the IMU's sample nearest to its own time.
    if (IsDue(now.k, config_.pose_rate / config_.imu_rate, 0.5)) LogPose(now);
    const RotorArray command = tracker_.Command(now.k, navigator_.state());
    navigator_.Add(now.reading, now.dt);
    if (config_.log_rotors) {
      log_->rotors.push_back(
          Channels(now.t, Measured(config_.log_commands ? command : now.state.rotors)));
    }
    return config_.motors ? DriveMotors(now, command) : command;
  }

 private:
  RotorArray Measured(RotorArray speeds) {
    if (config_.speed_noise == 0.0) return speeds;
    for (double& speed : speeds) speed *= 1.0 + config_.speed_noise * counter_.Normal();
    return speeds;
  }
  // Speeds that the motors reach for the wanted ones; logs commands, and the battery at its rate.
  RotorArray DriveMotors(const Instant& now, const RotorArray& wanted) {
    const MotorDrive drive(*config_.motors);
    const RotorArray command = drive.CommandFor(wanted);
    log_->motors.push_back(Channels(now.t, command));
    if (IsDue(now.k, config_.motors->battery_rate * now.dt, 0.0)) {
      const double error = config_.motors->battery_sigma * battery_.Normal();
      log_->battery.push_back({FromSeconds(now.t), drive.Voltage(now.t, command) + error});
    }
    return drive.SettledSpeed(now.t, command);
  }
  void LogPose(const Instant& now) {
    const Eigen::Quaterniond q = now.state.Attitude();
    log_->pose.push_back(simulation::MeasurePose(now.t, now.state.p_E + q * pose_arm_, q,
                                                 config_.noise.position, config_.noise.attitude,
                                                 &pose_));
    navigator_.AddPose(log_->pose.back().p_E, log_->pose.back().q_E);
  }
  void NoteError(const Instant& now) {
    const double error = (tracker_.PositionAt(now.k) - now.state.p_E).norm();
    if (!(error < kLost)) {
      throw InputError(fmt::format(
          "the vehicle lost the trajectory after {:.2f} s; fly a gentler one, or lower the "
          "disturbances and effects",
          now.t));
    }
    errors_.Note(error);
  }

  const RotorSimulation& config_;
  Vector3d pose_arm_;  // m, of the pose sensor from the centre of mass
  simulation::TrajectoryTracker tracker_;
  simulation::Navigator navigator_;
  Random pose_, battery_, counter_;
  simulation::PathErrors errors_;
  FlightLog* log_;
};

RotorTruth TruthOf(const RotorSimulation& config, const simulation::Trajectory& flown) {
  RotorTruth truth;
  truth.constants = TrueConstants(config);
  for (const simulation::TruthSample& now : flown.samples()) {
    const Eigen::Quaterniond& q = now.q_E_B;
    truth.states.emplace_back() << q.w(), q.x(), q.y(), q.z(), now.p_E, now.v_E, now.w_B;
  }
  return truth;
}

}  // namespace

RotorConstants TrueConstants(const RotorSimulation& config) {
  using Aero = RotorAeroModel;
  RotorConstants constants = RotorConstants::Zero();
  const auto set = [&](int index, double value) { constants[index - Aero::kMoving] = value; };
  for (int i = Model::kMoving; i < Model::kStates; ++i) set(i, config.vehicle.parameters[i]);
  for (int i = 0; i < 3; ++i) set(Aero::kDrag + i, config.drag[i]);
  set(Aero::kRotorInertia, config.rotor_inertia);
  MotorValues motors(FlownLag(config), 0.0, 0.0);
  if (config.motors) motors.tail<2>() << config.motors->idle, config.motors->voltage;
  constants.segment<kMotorUnknowns>(Aero::kMotors - Aero::kMoving) = motors;
  return constants;
}

double FlownLag(const RotorSimulation& config) {
  double lag = config.motor_lag;
  simulation::Apply(
      simulation::StagesWith(config.effects, config.vehicle.model.gravity()).motor_lag, &lag);
  return lag;
}

FlightLog SimulateRotorFlight(const RotorSimulation& config, const PiecewisePolynomial& path,
                              std::uint64_t seed, RotorTruth* truth) {
  FlightLog log;
  log.name = "rotor_flight";
  log.gravity = config.vehicle.model.gravity();
  log.vehicle = Vehicle{config.vehicle.parameters[Model::kMass], {}};
  for (const Rotor& r : config.vehicle.model.rotors()) {
    log.vehicle->rotors.push_back({r.position, r.axis, r.spin, r.k_f, r.k_m});
  }
  const double root_rate = std::sqrt(config.imu_rate);
  Random force(seed, "force"), twist(seed, "twist");
  simulation::SlowMoments slow(config.slow_moments, seed);
  const auto air = [&, sample = 0](const BodyState& state) mutable {
    const Vector3d gust_B = config.noise.force_density * root_rate * force.NormalVector3();
    const Vector3d twist_B = config.noise.angular_density * root_rate * twist.NormalVector3() +
                             slow.At(sample++ / config.imu_rate);
    const Vector3d force_E = simulation::ForceOf(config.forces, state);
    return simulation::Disturbance{state.Attitude() * gust_B + force_E, twist_B};
  };
  TrajectoryPilot pilot(config, path, seed, &log);
  simulation::FlightSetup setup = MakeSetup(config);
  setup.last = pilot.num_samples() - 1;
  const simulation::Trajectory flown = simulation::RunFlight(
      setup, pilot.Start(), air, [&](const Instant& now) { return pilot.Command(now); }, seed,
      &log);
  if (config.gyro_cutoff > 0.0) simulation::LowPassGyro(config.gyro_cutoff, &log.imu);
  simulation::StampLater(config.speeds_late, &log.rotors);
  if (truth != nullptr) {
    *truth = TruthOf(config, flown);
    truth->path_error_rms = pilot.errors().Rms();
  }
  return log;
}

void ReadRotorSimulation(const YamlMap& map, RotorSimulation* config) {
  YamlArchive a(map);
  a.Value("imu_rate", &config->imu_rate);
  a.Require(config->imu_rate >= 50.0, "imu_rate", "must be 50 Hz or more");
  a.Positive("pose_rate", &config->pose_rate);
  a.Require(config->pose_rate <= config->imu_rate, "pose_rate", "must be at most imu_rate");
  a.NotNegative("height", &config->height);
  a.Nested("noise", &config->noise);
  a.Value("drag", &config->drag);
  a.Positive("motor_lag", &config->motor_lag);
  a.NotNegative("slow_moments", &config->slow_moments);
  a.NotNegative("rotor_inertia", &config->rotor_inertia);
  a.NotNegative("speed_noise", &config->speed_noise);
  a.Value("speeds_late", &config->speeds_late);
  a.NotNegative("gyro_cutoff", &config->gyro_cutoff);  // zero: no filter
  a.Require(config->gyro_cutoff < 0.5 * config->imu_rate, "gyro_cutoff",
            "must be below half of imu_rate");
  a.Value("log_commands", &config->log_commands);
  if (map.Has("motors")) a.Nested("motors", &config->motors.emplace());
  if (map.Has("blades")) a.Nested("blades", &config->blades.emplace());
  a.Value("log_rotors", &config->log_rotors);
  a.Require(config->log_rotors || config->motors, "log_rotors",
            "leaves nothing of the rotors in the log; state `motors` too");
  simulation::Actors flight;
  flight.rotors = config->vehicle.model.num_rotors();
  flight.above_floor = config->height > 0.0;
  simulation::ReadActingEffects(map, flight, &config->effects);
  config->forces = simulation::ReadUnnamedForces(map, &config->effects);
  map.Finish();
}

bool IsRotorFlight(const YamlMap& map) { return map.Has("trajectory"); }

RotorSimulation ReadRotorFlightVehicle(const YamlMap& map) {
  const double gravity = map.Get<double>("gravity", 9.81);
  RotorSimulation simulation(ReadRotorVehicle(map.Child("vehicle"), gravity));
  const YamlMap biases = map.ChildOrEmpty("biases");
  const Eigen::Vector3d accel = biases.GetVector3("accel", Eigen::Vector3d::Zero());
  const Eigen::Vector3d gyro = biases.GetVector3("gyro", Eigen::Vector3d::Zero());
  biases.Finish();
  for (int i = 0; i < 3; ++i) {
    simulation.vehicle.parameters[RotorDrivenModel::kAccelBias + i] = accel[i];
    simulation.vehicle.parameters[RotorDrivenModel::kGyroBias + i] = gyro[i];
  }
  simulation.limits = ReadLimits(map.ChildOrEmpty("limits"));
  ReadRotorSimulation(map.ChildOrEmpty("simulation"), &simulation);
  return simulation;
}

RotorFlightConfig ReadRotorFlight(const YamlMap& map) {
  const RotorSimulation simulation = ReadRotorFlightVehicle(map);
  PiecewisePolynomial path =
      ReadTrajectory(map.Child("trajectory"), simulation.vehicle, simulation.limits);
  map.Finish();
  const std::string warning =
      LimitWarning(map.file(), RotorFlight(simulation.vehicle, path), simulation.limits);
  return {simulation, path, warning};
}

Flown Fly(const RotorSimulation& simulation, const PiecewisePolynomial& path, std::uint64_t seed) {
  Flown flown;
  flown.log = SimulateRotorFlight(simulation, path, seed, &flown.truth);
  flown.data = MakeRotorData(flown.log, simulation.vehicle.model.num_rotors(), {});
  for (const RotorPose& pose : flown.data.poses) {
    flown.nodes.push_back({flown.truth.states[std::lround(pose.t * simulation.imu_rate)]});
  }
  return flown;
}

RotorAeroModel ModelOf(const RotorSimulation& simulation) {
  const RotorDrivenModel& model = simulation.vehicle.model;
  return RotorAeroModel(model.rotors(), model.gravity());
}

RotorPrior DrawGuess(const RotorPrior& prior, const RotorConstants& truth, std::uint64_t seed) {
  RotorPrior drawn = prior;
  Random random(seed, "first guess");
  const int inertia = FindRotorConstant("I_x");
  do {
    for (int i = 0; i < RotorAeroModel::kConstants; ++i) {
      const double error = prior.sigma[i] * random.Normal();
      if (prior.sigma[i] > 0.0) drawn.mean[i] = truth[i] + error;
    }
  } while (!IsPhysicalInertia(drawn.mean.segment<3>(inertia)) ||
           !(drawn.mean[kMassConstant] > 0.0));
  return drawn;
}

}  // namespace trueline
