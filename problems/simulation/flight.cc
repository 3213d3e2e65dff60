#include "problems/simulation/flight.h"

#include "problems/common/error.h"

namespace trueline::simulation {
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
