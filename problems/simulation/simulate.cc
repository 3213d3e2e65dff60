#include "problems/simulation/simulate.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"
#include "problems/simulation/ahrs.h"
#include "problems/simulation/autopilot.h"
#include "problems/simulation/course.h"
#include "problems/simulation/gate_camera.h"

namespace trueline {
namespace simulation {
namespace {

constexpr double kLost = 20.0;  // m from the wanted place: the drone is not flying the course

// The drone, the air and the sensors that run at the IMU's rate, stepped together.
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

  // One sample of truth and IMU at time `t`, then on to the next.
  void Step(double t, double dt, TruthSample* truth, ImuReading* reading) {
    const BodyRate now = airframe_.Rate(t, state_, state_.rotors, turbulence_.value());
    const Motion motion{t, dt, state_.Attitude(), now.rate.v_E, state_.w_B, now.rate.w_B};
    *reading = imu_.Sample(motion, now.f_B, state_.rotors);
    const Quaterniond q_Ep_I = ahrs_.Update(motion, *reading);
    *truth = {t,       state_.p_E,     state_.v_E,    state_.Attitude(), state_.w_B, now.rate.w_B,
              now.f_B, now.rate.v_E, state_.rotors, now.thrust,        q_Ep_I};
    Advance(t, dt, now);
  }

  double distance_flown() const { return s_; }
  double PathError() const { return path_.DistanceTo(state_.p_E, s_, 1.0); }

 private:
  void Advance(double t, double dt, const BodyRate& now) {
    const PathPoint wanted = path_.At(s_);
    const PathPoint ahead = path_.At(s_ + wanted.speed * config_.autopilot.lead);
    if (!((wanted.p_E - state_.p_E).norm() < kLost)) {
      throw InputError(fmt::format(
          "the drone left the course at {:.1f} s; lower the speed, the effects or the turbulence",
          t));
    }
    const RotorArray command = autopilot_.Command(dt, state_, now, wanted, ahead);
    state_ = airframe_.Step(t, dt, state_, command, turbulence_.value());
    turbulence_.Advance(dt);
    s_ += dt * wanted.speed;
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

// What the flight's loop notes of how well the course was flown.
struct PathErrors {
  double squares = 0.0, largest = 0.0;
  int count = 0;

  void Note(double error) {
    squares += error * error;
    largest = std::max(largest, error);
    ++count;
  }
};

void LogAttitude(const SimulationConfig& config, const Stages& stages, const Trajectory& truth,
                 FlightLog* log) {
  double latency = 0.0;
  Apply(stages.attitude_latency, &latency);
  const double rate = config.ahrs.rate > 0.0 ? config.ahrs.rate : config.imu.rate;
  for (const double t : StreamTimes(rate, config.duration)) {
    log->attitude.push_back({FromSeconds(t), truth.At(t - latency).q_Ep_I});
  }
}

void LogMocap(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log) {
  if (config.mocap.rate <= 0.0) return;
  Random random(seed, "mocap");
  for (const double t : StreamTimes(config.mocap.rate, config.duration)) {
    const TruePose pose = truth.At(t);
    const Vector3d shift = config.mocap.position_sigma * random.NormalVector3();
    const Vector3d turn = config.mocap.attitude_sigma * random.NormalVector3();
    log->mocap.push_back({FromSeconds(t), pose.p_E + shift, pose.q_E_B * RotationByVector(turn)});
  }
}

void LogRotors(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
               FlightLog* log) {
  if (config.rotors.rate <= 0.0) return;
  log->vehicle = Vehicle{config.vehicle.mass, config.vehicle.rotors};
  Random random(seed, "rotors");
  for (const double t : StreamTimes(config.rotors.rate, config.duration)) {
    const RotorArray& speeds = truth.Nearest(t).rotors;
    ChannelsSample sample{FromSeconds(t), {}};
    for (const double w : speeds) sample.values.push_back(w + config.rotors.sigma * random.Normal());
    log->rotors.push_back(sample);
  }
}

// Distance to the floor along B's z axis.
void LogRange(const SimulationConfig& config, const Trajectory& truth, std::uint64_t seed,
              FlightLog* log) {
  if (config.range.rate <= 0.0) return;
  Random random(seed, "range");
  for (const double t : StreamTimes(config.range.rate, config.duration)) {
    const TruePose pose = truth.At(t);
    const double slant = (pose.q_E_B * Vector3d::UnitZ()).z();
    const double noise = config.range.sigma * random.Normal();
    log->range.push_back({FromSeconds(t), -pose.p_E.z() / std::max(slant, 0.1) + noise});
  }
}

// Angles of eq. 14's R_Ep_E over the log: their mean and spread, and the tilt they make.
void DescribeAhrs(SimulationTruth* truth) {
  const Quaterniond q_B_I = FrameChange(truth->config.imu.misalignment);
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  double tilt_squares = 0.0;
  for (const TruthSample& sample : truth->trajectory) {
    const Quaterniond q_Ep_E = sample.q_Ep_I * (sample.q_E_B * q_B_I).conjugate();
    const Vector3d angles = EulerOf(q_Ep_E);
    const double tilt = std::acos(std::min(1.0, (q_Ep_E * Vector3d::UnitZ()).z()));
    sum += angles;
    squares += angles.cwiseAbs2();
    tilt_squares += tilt * tilt;
    truth->tilt_error_max = std::max(truth->tilt_error_max, tilt);
  }
  const auto count = static_cast<double>(truth->trajectory.size());
  truth->ahrs_error_mean = sum / count;
  truth->ahrs_error_sigma =
      (squares / count - truth->ahrs_error_mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  truth->tilt_error_rms = std::sqrt(tilt_squares / count);
}

void DescribeFlight(const PathErrors& errors, SimulationTruth* truth) {
  for (const TruthSample& sample : truth->trajectory) {
    truth->speed_mean += sample.v_E.norm() / static_cast<double>(truth->trajectory.size());
    truth->speed_max = std::max(truth->speed_max, sample.v_E.norm());
  }
  truth->path_error_rms = std::sqrt(errors.squares / std::max(1, errors.count));
  truth->path_error_max = errors.largest;
}

}  // namespace
}  // namespace simulation

FlightLog Simulate(const SimulationConfig& config, std::uint64_t seed, SimulationTruth* truth) {
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
  for (int k = -warm_up; k < count; ++k) {
    TruthSample sample;
    ImuReading reading;
    if (k == 0) s_start = flight.distance_flown();
    if (k >= 0 && k % 32 == 0) errors.Note(flight.PathError());
    flight.Step(k / rate, 1.0 / rate, &sample, &reading);
    trajectory.Add(sample);
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
  DescribeAhrs(truth);
  DescribeFlight(errors, truth);
  return log;
}

}  // namespace trueline
