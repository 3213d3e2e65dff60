#include "problems/simulation/simulate.h"

#include <cmath>

#include "problems/common/error.h"
#include "problems/simulation/autopilot.h"
#include "problems/simulation/course.h"
#include "problems/simulation/flight.h"
#include "problems/simulation/forces.h"
#include "problems/simulation/streams.h"

namespace trueline {
namespace simulation {
namespace {

constexpr double kLost = 20.0;  // m from the reference: the drone is not flying the course

// Flies round the course and notes how well.
class CoursePilot {
 public:
  CoursePilot(const SimulationConfig& config, const Path& path)
      : lead_(config.autopilot.lead),
        path_(path),
        autopilot_(config.vehicle, config.autopilot, config.gravity) {}

  BodyState Start() const { return autopilot_.Trim(path_.At(0.0)); }

  RotorArray Command(const Instant& now) {
    if (now.k == 0) s_start_ = s_;
    if (now.k >= 0 && now.k % 32 == 0) errors_.Note(path_.DistanceTo(now.state.p_E, s_, 1.0));
    const PathPoint wanted = path_.At(s_);
    const PathPoint ahead = path_.At(s_ + wanted.speed * lead_);
    if (!((wanted.p_E - now.state.p_E).norm() < kLost)) {
      throw InputError(fmt::format(
          "the drone left the course at {:.1f} s; lower the speed, the effects or the turbulence",
          now.t));
    }
    s_ += now.dt * wanted.speed;
    return autopilot_.Command(now.dt, now.state, now.rate, wanted, ahead);
  }

  const PathErrors& errors() const { return errors_; }
  double Laps() const { return (s_ - s_start_) / path_.length(); }

 private:
  double lead_;  // s
  const Path& path_;
  Autopilot autopilot_;
  PathErrors errors_;
  double s_ = 0.0;        // m, arc length that the path is at
  double s_start_ = 0.0;  // m, at the start of the log
};

FlightSetup MakeSetup(const SimulationConfig& config) {
  FlightSetup setup;
  setup.vehicle = config.vehicle;
  setup.imu = config.imu;
  setup.ahrs = config.ahrs;
  setup.gravity = config.gravity;
  setup.stages = StagesWith(config.effects, config.gravity);
  const double rate = config.imu.rate;
  setup.first = -static_cast<int>(std::ceil(config.warm_up * rate));
  setup.last = static_cast<int>(StreamTimes(rate, config.duration).size()) - 1;
  setup.time = [rate](int k) { return k / rate; };
  return setup;
}

// AHRS statistics: angles of eq. 14's R_Ep_E over the log, their mean and spread, and the
// resulting tilt.
void DescribeAhrs(SimulationTruth* truth) {
  const Quaterniond q_B_I = FrameChange(truth->config.imu.misalignment);
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  const TruthSample& first = truth->trajectory.front();
  const Vector3d origin = EulerOf(first.q_Ep_I * (first.q_E_B * q_B_I).conjugate());
  double tilt_squares = 0.0;
  for (const TruthSample& sample : truth->trajectory) {
    const Quaterniond q_Ep_E = sample.q_Ep_I * (sample.q_E_B * q_B_I).conjugate();
    const Vector3d angles = EulerOf(q_Ep_E) - origin;  // avoids cancellation in squares
    const double tilt = std::acos(std::min(1.0, (q_Ep_E * Vector3d::UnitZ()).z()));
    sum += angles;
    squares += angles.cwiseAbs2();
    tilt_squares += tilt * tilt;
    truth->tilt_error_max = std::max(truth->tilt_error_max, tilt);
  }
  const auto count = static_cast<double>(truth->trajectory.size());
  const Vector3d mean = sum / count;
  truth->ahrs_error_mean = origin + mean;
  truth->ahrs_error_sigma = (squares / count - mean.cwiseAbs2()).cwiseMax(0.0).cwiseSqrt();
  truth->tilt_error_rms = std::sqrt(tilt_squares / count);
}

// Statistics of speed, path and accelerometer bias.
void DescribeFlight(const PathErrors& errors, SimulationTruth* truth) {
  const auto count = static_cast<double>(truth->trajectory.size());
  for (const TruthSample& sample : truth->trajectory) {
    truth->accel_walk_mean += sample.accel_walk / count;
    truth->speed_mean += sample.v_E.norm() / count;
    truth->speed_max = std::max(truth->speed_max, sample.v_E.norm());
  }
  truth->path_error_rms = errors.Rms();
  truth->path_error_max = errors.largest;
}

}  // namespace
}  // namespace simulation

FlightLog Simulate(const SimulationConfig& config, std::uint64_t seed, SimulationTruth* truth,
                   const SimulationProgress& progress) {
  using namespace simulation;  // NOLINT(google-build-using-namespace): its own internals
  const Course course = BuildCourse(config.course);
  FlightSetup setup = MakeSetup(config);
  setup.progress = progress;
  OrnsteinUhlenbeck turbulence(config.turbulence.sigma, config.turbulence.memory, seed,
                               "turbulence");
  const auto air = [&](const BodyState& state) {
    const Disturbance now{turbulence.value() + ForceOf(config.forces, state)};
    turbulence.Advance(1.0 / config.imu.rate);
    return now;
  };
  CoursePilot pilot(config, course.path);
  FlightLog log;
  log.name = config.name;
  log.gravity = config.gravity;
  log.gates = course.gates;
  const Trajectory trajectory = RunFlight(
      setup, pilot.Start(), air, [&](const Instant& now) { return pilot.Command(now); }, seed,
      &log);

  LogAttitude(config, setup.stages, trajectory, &log);
  LogSensors(config, trajectory, seed, &log);
  GateCamera camera(config.detector, course.gates, setup.stages, seed);
  log.fixes = camera.Fixes(trajectory);
  const bool gnss = config.gnss.rate > 0.0;
  if (gnss) LogGnss(config, setup.stages, trajectory, seed, &log);
  if (truth == nullptr) return log;

  *truth = SimulationTruth();
  truth->config = config;
  truth->seed = seed;
  truth->trajectory.assign(trajectory.samples().begin() - setup.first, trajectory.samples().end());
  truth->laps = pilot.Laps();
  truth->passes = gnss ? 0 : static_cast<int>(camera.Views(trajectory).size());
  DescribeAhrs(truth);
  DescribeFlight(pilot.errors(), truth);
  return log;
}

}  // namespace trueline
