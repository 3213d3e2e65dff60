#include "problems/simulation/simulate.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/simulation/ahrs.h"
#include "problems/simulation/autopilot.h"
#include "problems/simulation/course.h"
#include "problems/simulation/gate_camera.h"
#include "problems/simulation/streams.h"
#include "problems/simulation/summary.h"

namespace trueline {
namespace simulation {
namespace {

constexpr double kLost = 20.0;  // m from the reference: the drone is not flying the course

// The drone, the air and the sensors at the IMU's rate, stepped together.
class Flight {
 public:
  Flight(const SimulationConfig& config, const Course& course, const Stages& stages,
         std::uint64_t seed)
      : config_(config),
        path_(course.path),
        airframe_(config.vehicle, config.gravity, stages),
        autopilot_(config.vehicle, config.autopilot, config.gravity),
        turbulence_(config.turbulence.sigma, config.turbulence.memory, seed, "turbulence"),
        imu_(config.imu, static_cast<int>(config.vehicle.rotors.size()), seed, stages),
        ahrs_(config.ahrs, config.imu, config.gravity, seed, stages),
        state_(autopilot_.Trim(course.path.At(0.0))) {}

  // Records one sample of truth and IMU at time `t`, then integrates to the next.
  void Step(double t, double dt, TruthSample* truth, ImuReading* reading) {
    const BodyRate now = airframe_.Rate(t, state_, state_.rotors, turbulence_.value());
    const Motion motion{t, dt, state_.Attitude(), now.rate.v_E, state_.w_B, now.rate.w_B};
    *reading = imu_.Sample(motion, now.f_B, state_.rotors);
    const Quaterniond q_Ep_I = ahrs_.Update(motion, *reading);
    const RotorArray command = Command(t, dt, now);
    *truth = {t,       state_.p_E,   state_.v_E,    state_.Attitude(), state_.w_B, now.rate.w_B,
              now.f_B, now.rate.v_E, state_.rotors, command,           now.thrust, q_Ep_I};
    state_ = airframe_.Step(t, dt, state_, command, turbulence_.value());
    turbulence_.Advance(dt);
    s_ += dt * path_.At(s_).speed;
  }

  double distance_flown() const { return s_; }
  double PathError() const { return path_.DistanceTo(state_.p_E, s_, 1.0); }

 private:
  RotorArray Command(double t, double dt, const BodyRate& now) {
    const PathPoint wanted = path_.At(s_);
    const PathPoint ahead = path_.At(s_ + wanted.speed * config_.autopilot.lead);
    if (!((wanted.p_E - state_.p_E).norm() < kLost)) {
      throw InputError(fmt::format(
          "the drone left the course at {:.1f} s; lower the speed, the effects or the turbulence",
          t));
    }
    return autopilot_.Command(dt, state_, now, wanted, ahead);
  }

  const SimulationConfig& config_;
  const Path& path_;
  Airframe airframe_;
  Autopilot autopilot_;
  OrnsteinUhlenbeck turbulence_;
  Imu imu_;
  Ahrs ahrs_;
  BodyState state_;
  double s_ = 0.0;  // m, arc length that the path is at
};

}  // namespace
}  // namespace simulation

FlightLog Simulate(const SimulationConfig& config, std::uint64_t seed, SimulationTruth* truth,
                   const SimulationProgress& progress) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  const Course course = BuildCourse(config.course);
  const Stages stages = HangEffects(config.effects, config.gravity);
  Flight flight(config, course, stages, seed);
  const double rate = config.imu.rate;
  const auto warm_up = static_cast<int>(std::ceil(config.warm_up * rate));
  const auto count = static_cast<int>(StreamTimes(rate, config.duration).size());

  FlightLog log;
  log.name = config.name;
  log.gravity = config.gravity;
  log.gates = course.gates;
  log.imu.reserve(count);
  Trajectory trajectory(rate);
  PathErrors errors;
  double s_start = 0.0;
  Eigen::Vector3d accel_walk = Eigen::Vector3d::Zero();
  for (int k = -warm_up; k < count; ++k) {
    TruthSample sample;
    ImuReading reading;
    if (k == 0) s_start = flight.distance_flown();
    if (progress && k % 4096 == 0) progress(k / rate);
    if (k >= 0 && k % 32 == 0) errors.Note(flight.PathError());
    flight.Step(k / rate, 1.0 / rate, &sample, &reading);
    trajectory.Add(sample);
    if (k >= 0) accel_walk += reading.accel_walk / count;
    if (k >= 0) log.imu.push_back({FromSeconds(k / rate), reading.accel, reading.gyro});
  }

  LogAttitude(config, stages, trajectory, &log);
  LogMocap(config, trajectory, seed, &log);
  LogRotors(config, trajectory, seed, &log);
  LogRange(config, trajectory, seed, &log);
  GateCamera camera(config.detector, course.gates, stages, seed);
  log.fixes = camera.Fixes(trajectory);
  if (truth == nullptr) return log;

  *truth = SimulationTruth();
  truth->config = config;
  truth->seed = seed;
  truth->trajectory.assign(trajectory.samples().begin() + warm_up, trajectory.samples().end());
  truth->laps = (flight.distance_flown() - s_start) / course.path.length();
  truth->passes = static_cast<int>(camera.Views(trajectory).size());
  truth->accel_walk_mean = accel_walk;
  DescribeAhrs(truth);
  DescribeFlight(errors, truth);
  return log;
}

}  // namespace trueline
