#include "problems/simulation/flight.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"

namespace trueline::simulation {

TruePose Trajectory::At(double t) const {
  const double place = std::clamp((t - start()) * rate_, 0.0, samples_.size() - 1.0);
  const std::size_t i = std::min(static_cast<std::size_t>(place), samples_.size() - 2);
  const TruthSample& a = samples_[i];
  const TruthSample& b = samples_[i + 1];
  const double f = place - static_cast<double>(i);
  const double dt = 1.0 / rate_;
  const Vector3d slip_a = dt * a.v_E - (b.p_E - a.p_E);
  const Vector3d slip_b = (b.p_E - a.p_E) - dt * b.v_E;
  TruePose pose;
  pose.p_E = a.p_E + f * (b.p_E - a.p_E) + f * (1.0 - f) * ((1.0 - f) * slip_a + f * slip_b);
  pose.q_E_B = a.q_E_B.slerp(f, b.q_E_B);
  pose.q_Ep_I = a.q_Ep_I.slerp(f, b.q_Ep_I);
  return pose;
}

const TruthSample& Trajectory::Nearest(double t) const {
  const double place = std::clamp((t - start()) * rate_, 0.0, samples_.size() - 1.0);
  return samples_[static_cast<std::size_t>(std::lround(place))];
}

std::vector<double> StreamTimes(double rate, double duration) {
  std::vector<double> times;
  const auto count = static_cast<std::size_t>(std::floor(duration * rate + 1e-6)) + 1;
  times.reserve(count);
  for (std::size_t i = 0; i < count; ++i) times.push_back(static_cast<double>(i) / rate);
  return times;
}

namespace {

// Runge-Kutta steps much longer than the rotors' lag would make their speeds grow without bound.
void CheckLag(double lag, double step) {
  constexpr double kLongest = 2.5;  // steps in lags; 2.79 is where they grow
  if (lag > 0.0 && step <= kLongest * lag) return;
  throw InputError(fmt::format(
      "a motor lag of {:g} s can't be integrated in steps of {:g} s; state a lag of {:.2g} s or "
      "more, or a higher rate of the IMU",
      lag, step, step / kLongest));
}

}  // namespace

Trajectory RunFlight(const FlightSetup& setup, const BodyState& start, const Air& air,
                     const Pilot& pilot, std::uint64_t seed, FlightLog* log) {
  const double dt = 1.0 / setup.imu.rate, h = dt / setup.substeps;
  const Airframe airframe(setup.vehicle, setup.gravity, setup.stages);
  CheckLag(airframe.motor_lag(), h);
  Imu imu(setup.imu, static_cast<int>(setup.vehicle.rotors.size()), seed, setup.stages);
  std::optional<Ahrs> ahrs;
  if (setup.ahrs) ahrs.emplace(*setup.ahrs, setup.imu, setup.gravity, seed, setup.stages);
  log->imu.reserve(setup.last + 1);
  Trajectory trajectory(setup.imu.rate);
  BodyState state = start;
  RotorArray command = start.rotors;  // that the rotors follow until the sample
  for (int k = setup.first; k <= setup.last; ++k) {
    const double t = setup.time(k);
    if (setup.progress && k % 4096 == 0) setup.progress(t);
    const Disturbance now = air(state);
    const BodyRate rate = airframe.Rate(t, state, command, now.gust_E, now.twist_B);
    const Motion motion{t,         dt,           state.Attitude(), state.v_E, rate.rate.v_E,
                        state.w_B, rate.rate.w_B};
    const ImuReading reading = imu.Sample(motion, rate.f_B, state.rotors);
    if (k >= 0) log->imu.push_back({FromSeconds(t), reading.accel, reading.gyro});
    const Quaterniond q_Ep_I = ahrs ? ahrs->Update(motion, reading) : Quaterniond::Identity();
    command = pilot({k, t, dt, state, rate, reading});
    trajectory.Add({t, state.p_E, state.v_E, motion.q_E_B, state.w_B, motion.dw_B, rate.f_B,
                    motion.a_E, state.rotors, command, rate.thrust, q_Ep_I, reading.accel_walk});
    for (int j = 0; j < setup.substeps; ++j) {
      state = airframe.Step(t + j * h, h, state, command, now.gust_E, now.twist_B);
    }
  }
  return trajectory;
}

}  // namespace trueline::simulation
