// A flight as the rotor-driven estimators see it: rotor speeds at any time, IMU samples, and poses
// (or positions) at which nodes are placed.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "cost_functions/models/rotor_aero_model.h"
#include "cost_functions/pose_residual.h"
#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_state.h"

namespace trueline {

// Measured rotor speeds have noise: an ESC counts commutations, and a log rounds. A model that
// takes them for exact finds too large an inertia, since the noise scatters the moments that are
// compared with the body's acceleration (errors in variables). The mean of a speed given all its
// samples has an error that does not correlate with it; a fit to it is unbiased (regression
// calibration, Carroll et al., Measurement Error in Nonlinear Models, 2006, ch. 4), as far as the
// speeds move as assumed. Speeds change fast in manoeuvres and slowly between them, so a bias is
// left, which WithoutSpeedNoiseBias removes.

// A speed that walks at random, as does its rate, and its measurement with white noise.
struct SpeedWalk {
  double noise;  // (rad/s)^2, variance of a sample
  double speed;  // (rad/s)^2/s
  double rate;   // (rad/s^2)^2/s
};

// How speeds move. Rotors move together: thrust changes all speeds, a moment only their
// differences, which are smaller. So each principal component of the changes has its own walk. All
// have the same noise.
struct SpeedModel {
  double sigma = 0.0;            // rad/s, noise of a sample; 0: the speeds are exact
  Eigen::MatrixXd components;    // orthonormal columns, by rotor
  std::vector<SpeedWalk> walks;  // of each component
};

// The model of the greatest likelihood, given the speeds (rad/s, by time, then rotor) at times `t`
// (s). Noise below a thousandth of the speeds counts as none.
SpeedModel LearnSpeedModel(const std::vector<double>& t, const Eigen::MatrixXd& speeds);

// Means of the speeds given all samples. The means of what is left are added `again` times
// (twicing, Tukey, Exploratory Data Analysis, 1977): more of fast changes is kept, and more noise.
Eigen::MatrixXd SmoothSpeeds(const std::vector<double>& t, const Eigen::MatrixXd& speeds,
                             const SpeedModel& model, int again = 0);

// Which stream gives the rotor speeds: measured speeds, or commands to the motors.
enum class RotorSource { kRotors, kMotors };

// Which stream of poses is fitted.
enum class PoseSource { kPose, kMocap };

struct RotorPose {
  double t;             // s
  Eigen::Vector3d p_E;  // m, of P
  Eigen::Quaterniond q_E_P;
};
PoseError ErrorOf(const RotorPose& pose, const RotorNoise& noise);

struct RotorImu {
  double t;               // s
  Eigen::Vector3d accel;  // m/s^2
  Eigen::Vector3d gyro;   // rad/s
};

// Motor commands with the battery's voltage; a command is held until the next row.
struct MotorCommands {
  MotorCurve curve;
  std::vector<std::vector<double>> commands;  // 0 to 1, by time, then rotor
  std::vector<double> voltages;               // V, by time
};

// Rotor speeds as rotors.csv states them, and how they move.
struct MeasuredSpeeds {
  Eigen::MatrixXd speeds;  // rad/s, by time, then rotor
  SpeedModel model;        // exact unless noise was learned
};

// A stretch of flight without gaps. Times are seconds from `origin`.
struct RotorData {
  TimeNs origin = 0;
  double since_start = 0.0;  // s, of `origin` since the log's first IMU sample
  bool attitude = true;      // of the poses is measured; else it is only where fits start from
  std::vector<RotorImu> imu;
  std::vector<RotorPose> poses;
  std::vector<double> speed_times;          // s
  std::vector<std::vector<double>> speeds;  // rad/s, by time, then rotor
  MeasuredSpeeds measured;                  // that `speeds` are made of; empty for commands
  double speed_lag = 0.0;                   // s, of the rotors behind the measured speeds
  double speed_density = 0.0;               // rad/s/sqrt(Hz), of their noise (rotor_step.h)
  // Set where speeds are computed from commands: the commands, the unknowns' values that `speeds`
  // were computed with, and the derivatives of the speeds by them.
  std::optional<MotorCommands> motors;
  MotorValues motors_at = MotorValues::Zero();
  double added_lag = 0.0;  // s, of the motors beyond the unknown motor_lag
  std::vector<std::vector<MotorValues>> slopes;

  // Replaces the measured speeds by these without noise (rad/s, by time, then rotor).
  void SetSpeeds(const Eigen::MatrixXd& smooth);
  // Recomputes the speeds from the commands at other values of the unknowns, or at the nearest that
  // motors can have.
  void SimulateMotors(const MotorValues& at);
  // Rotor speeds at `t` (s from `origin`): linear between samples, constant outside. Accelerations
  // are the slopes.
  RotorInput InputAt(double t) const;
};

// The measured pose at `t`, up to 5 ms earlier or 20 ms later, where poses are farther apart a
// tenth more than their mean spacing later; null where there is none.
const RotorPose* PoseNear(const RotorData& data, double t);

struct RotorDataOptions {
  PoseSource source = PoseSource::kPose;
  bool attitude = true;      // false: position only
  double rotor_delay = 0.0;  // s, the speeds in rotors.csv act this much later (negative: earlier)
  double gyro_delay = 0.0;   // s, age of a gyroscope's reading at its stamp, as a filter makes it
  double motor_lag = 0.0;    // s, of the rotors behind what rotors.csv states; 0: it is measured
  RotorSource rotors = RotorSource::kRotors;
  bool smooth_rotors = true;         // rotors.csv has noise, which is learned (SpeedModel)
  std::optional<SpeedModel> speeds;  // what was learned before, from the same start on
  bool weigh_speed_noise = true;     // what is left of it acts as forces and moments (rotor_step.h)
  std::optional<MotorCurve> motors;  // where kMotors; motor_lag then adds to motors_at's
  MotorValues motors_at = MotorValues(0.03, 0.0, 1.0);
  double pose_rate = 30.0;  // Hz; faster streams are thinned to about this rate
  double start = 0.0;       // s after the streams' common start
  double end = 0.0;         // s before the streams' common end
  double duration = 0.0;    // s; 0: to the end
};

// Reads the gyroscope of `data` from `log` again, `delay` (s) after its stamps: linear between
// samples, constant outside.
void DelayGyro(const FlightLog& log, double delay, RotorData* data);

// Cuts the log to the time that all streams cover. Throws InputError naming a stream that is
// missing, too short or not positive (battery), or for a motor lag that is not positive.
RotorData MakeRotorData(const FlightLog& log, int rotors, const RotorDataOptions& options);

// Initial values of fits: the moving states at each pose, from poses and gyro alone.

// One node for each pose. Position is the pose's less the lever arm of the pose sensor, velocity a
// difference over about 0.1 s, rate the mean of the gyro within 10 ms.
std::vector<RotorNode> RoughNodes(const RotorData& data, const RotorConstants& constants);

}  // namespace trueline
