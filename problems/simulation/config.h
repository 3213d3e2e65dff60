// Configuration of a simulated flight: course, vehicle, autopilot, air, sensors, effects. SI units
// and radians; the defaults are a Bebop-like drone with ordinary sensors. The YAML keys are the
// names of the members (config.cc), each with its unit here.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/effects/effect.h"
#include "problems/log/flight_log.h"

namespace trueline {

namespace simulation {

using Eigen::Vector3d;

// One corner of a course of lines and arcs, or one way point of a spline. Its speed and gate apply
// to the way that leads to it.
struct CoursePoint {
  Eigen::Vector2d position;  // m, north and east
  double radius = 0.0;       // m, of the arc that rounds the corner (corners only)
  double altitude = 1.5;     // m above the floor
  double speed = 1.8;        // m/s, on the straight that leads here
  double turn_speed = 1.8;   // m/s, on the arc of the corner
  int gate = -1;  // id of the gate at the end of the straight (at the way point); -1: none
};

struct CourseConfig {
  bool spline = false;  // way points joined by a closed spline, or corners rounded by arcs
  std::vector<CoursePoint> points;
  double along_limit = 4.0;     // m/s^2, of the speed profile
  double lateral_limit = 15.0;  // m/s^2: slower where the path is too tight
};

// Blades of a rotor (blade_elements.h). Defaults: a 5 inch propeller of plastic.
struct BladeConfig {
  int count = 2;
  double radius = 0.0635;         // m
  double chord = 0.012;           // m
  double twist = -0.25;           // rad over a radius
  double lift_slope = 5.5;        // 1/rad, of a section
  double mass = 0.001;            // kg, of one blade
  double flap_frequency = 150.0;  // Hz, of a blade that flaps on the rotor at rest
  double air_density = 1.2;       // kg/m^3
};

struct VehicleConfig {
  double mass = 0.40;                              // kg
  Vector3d inertia = {0.91e-3, 1.24e-3, 2.05e-3};  // kg m^2, diagonal
  std::vector<Rotor> rotors;                       // filled with an X of four when left out
  double motor_lag = 0.03;                         // s, rotor speed follows its command
  double rotor_inertia = 0.0;                      // kg m^2, of each rotor about its axis
  double max_rotor_speed = 1300.0;                 // rad/s
  Vector3d drag = {-0.50, -0.55, -0.10};           // 1/s: K_x, K_y, K_z of f_B = K v_B
  std::optional<BladeConfig> blades;               // left out: thrust k_f omega^2, k_m omega^2
};

// Motors of a rotor-driven flight, commanded as a share of the battery's voltage.
struct MotorDriveConfig {
  double full_speed = 2200.0;    // rad/s, at full command and nominal voltage
  double nominal_voltage = 7.4;  // V
  double idle = 0.15;            // share of full speed at a command just above zero
  double voltage = 1.0;          // exponent with which speed follows voltage
  double battery = 7.8;          // V, at the start and without load
  double drop = 0.02;            // V/s
  double sag = 0.4;              // V, at full command on all rotors
  double battery_sigma = 0.005;  // V, of a reading
  double battery_rate = 10.0;    // Hz
};

struct AutopilotConfig {
  double position_gain = 4.0;                // 1/s^2
  double velocity_gain = 3.5;                // 1/s
  Vector3d attitude_gain = {9.0, 9.0, 4.0};  // 1/s
  Vector3d rate_gain = {20.0, 20.0, 10.0};   // 1/s
  double disturbance_time = 0.25;            // s, low-pass of the measured unmodelled force
  double lead = 0.16;                        // s, the path is read ahead by the attitude's lag
  double max_tilt = 1.2;                     // rad
};

struct TurbulenceConfig {
  Vector3d sigma = {0.0, 0.0, 0.0};  // m/s^2, specific force in E, each axis
  double memory = 0.8;               // s
};

struct VibrationConfig {
  std::vector<double> accel;  // m/s^2, amplitude of each harmonic of each rotor's frequency
  std::vector<double> gyro;   // rad/s
};

struct ImuConfig {
  double rate = 512.0;                       // Hz
  double accel_noise_density = 0.0;          // m/s^2/sqrt(Hz)
  double gyro_noise_density = 0.0;           // rad/s/sqrt(Hz)
  Vector3d accel_bias = Vector3d::Zero();    // m/s^2, measured = true + bias, in I
  Vector3d gyro_bias = Vector3d::Zero();     // rad/s
  double accel_bias_walk = 0.0;              // m/s^2/sqrt(s)
  double gyro_bias_walk = 0.0;               // rad/s/sqrt(s)
  Vector3d misalignment = Vector3d::Zero();  // rad: phi_I_B, theta_I_B, psi_I_B of eq. 8
  VibrationConfig vibration;
  double accel_range = 0.0;  // m/s^2, saturates beyond +-range; 0: never
  double gyro_range = 0.0;   // rad/s
  double accel_step = 0.0;   // m/s^2, quantisation; 0: none
  double gyro_step = 0.0;    // rad/s
};

enum class AhrsKind { kComplementaryFilter, kDriftingError, kConstantError };

struct AhrsConfig {
  AhrsKind kind = AhrsKind::kComplementaryFilter;
  double rate = 0.0;  // Hz; 0: that of the IMU
  // Complementary filter, fed with the simulated IMU (fig. 3).
  double tilt_gain = 0.05;        // 1/s, proportional
  double integral_gain = 0.0006;  // 1/s^2
  double heading_gain = 0.2;      // 1/s, towards the (magnetic) heading
  double heading_error = 0.0;     // rad, what the heading reference reads too much
  // Drifting and constant error: Phi_E^E' = constant + Ornstein-Uhlenbeck + Wiener.
  Vector3d constant = Vector3d::Zero();       // rad: phi_E_Ep, theta_E_Ep, psi_E_Ep
  Vector3d drift_sigma = Vector3d::Zero();    // rad
  double drift_memory = 30.0;                 // s
  Vector3d drift_density = Vector3d::Zero();  // rad/sqrt(s)
};

struct DetectorConfig {
  int fixes_min = 15, fixes_max = 20;  // fixes each time that a gate comes into view
  double max_rate = 60.0;              // Hz, of the camera: bounds the fixes of a short view
  double range_min = 0.2;              // m, a nearer gate fills the picture
  double range_max = 3.0;              // m
  double fov_horizontal_deg = 120.0;   // full angle
  double fov_vertical_deg = 100.0;     // full angle
  double camera_pitch_deg = 0.0;       // positive: camera looks up
  double max_view_deg = 60.0;          // angle between line of sight and flight direction
  double sigma_factor = 0.1;           // 1: sigma = factor * distance (eq. 33)
  double sigma_floor = 0.02;           // m
  double outlier_share = 0.0;          // 1
  double outlier_size = 2.0;           // m, outliers are uniform within +-size on each axis
  double tail_dof = 0.0;               // degrees of freedom of Student's t; 0: normal
  double latency = 0.0;                // s, a fix stamped t was measured at t - latency
  double jitter = 0.0;                 // s, standard deviation of the stamp
  bool turned_by_ahrs = false;         // vector turned to E by the AHRS's attitude, or by truth
};

// Position fixes of a satellite receiver, in place of the gates' (rate 0: there is none). The log
// then has no gates.
struct GnssConfig {
  double rate = 0.0;               // Hz
  double sigma = 0.8;              // m, each axis, of the error that is correlated in time
  double correlation_time = 60.0;  // s, of that error: a Gauss-Markov process
  double white_sigma = 0.05;       // m, each axis, of the part that is new at each fix
  double stated_sigma = 0.8;       // m, as the receiver states it
  double latency = 0.0;            // s, a fix stamped t was measured at t - latency
  // Errors of another form than an estimator expects; 0: none.
  double latency_jitter = 0.0;  // s, sigma of each fix's own delay beside `latency`
  double wave = 0.0;            // m, amplitude in each axis of an error that swings (multipath)
  double wave_period = 20.0;    // s
  double jump = 0.0;            // m, sigma in each axis of steps that stay (other satellites)
  double jump_interval = 20.0;  // s, mean time between them
  double outlier_share = 0.0;   // of the fixes
  double outlier_size = 3.0;    // m, sigma in each axis
};

// Numbers of the sensors that are sampled from the flight, by sensor and name (catalogue with
// units: streams.cc).
using SensorSettings = std::map<std::string, std::map<std::string, double>>;
SensorSettings DefaultSensors();

// One entry of `forces:` (forces.h).
struct UnnamedForce {
  int axis = 0;                                     // x, y, z of B, then of E
  std::vector<int> factors;                         // of velocity and turn rate in B
  double size = 0.0;                                // m/s^2 for each unit of their product
  Eigen::Vector2d place = Eigen::Vector2d::Zero();  // m, north and east
  double radius = 0.0;                              // m; 0: everywhere
};

// Uniform range from which DrawVariant draws a parameter.
struct Range {
  double low, high;
};

// The sections of a configuration, each described once.
void Serialize(YamlArchive* a, MotorDriveConfig* drive);
void Serialize(YamlArchive* a, BladeConfig* blades);
void Serialize(YamlArchive* a, AutopilotConfig* autopilot);
void Serialize(YamlArchive* a, TurbulenceConfig* turbulence);
void Serialize(YamlArchive* a, ImuConfig* imu);
void Serialize(YamlArchive* a, AhrsConfig* ahrs);
void Serialize(YamlArchive* a, DetectorConfig* detector);
void Serialize(YamlArchive* a, GnssConfig* gnss);
// Each sensor has a section of its own; all numbers are zero or above.
void Serialize(YamlArchive* a, SensorSettings* sensors);

}  // namespace simulation

inline constexpr double kLongestFlight = 1e5;  // s, of a log

struct SimulationConfig {
  std::string name = "simulated";
  double duration = 100.0;  // s, of the log
  double warm_up = 10.0;    // s, flown before the log starts, for filters to settle
  double gravity = 9.81;    // m/s^2
  simulation::CourseConfig course;
  simulation::VehicleConfig vehicle;
  simulation::AutopilotConfig autopilot;
  simulation::TurbulenceConfig turbulence;
  simulation::ImuConfig imu;
  simulation::AhrsConfig ahrs;
  simulation::DetectorConfig detector;
  simulation::GnssConfig gnss;
  simulation::SensorSettings sensors = simulation::DefaultSensors();
  std::vector<Effect> effects;  // units in the catalogue (effects.h); terms are those of `forces`
  std::vector<simulation::UnnamedForce> forces;
  std::map<std::string, simulation::Range> randomise;
};

// Throws InputError with file, line and key for unknown or missing keys, units out of range,
// unknown effects and courses that can't be flown. Calls map.Finish().
SimulationConfig ReadSimulationConfig(const YamlMap& map);

}  // namespace trueline
