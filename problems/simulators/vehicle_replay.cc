#include "problems/simulators/vehicle_replay.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "problems/common/error.h"
#include "problems/effects/declaration.h"
#include "problems/rotor/rotor_data.h"
#include "problems/rotor/rotor_step.h"
#include "problems/simulators/vehicle_file.h"

namespace trueline {
namespace {

using Driven = RotorDrivenModel;

// Level flight, a metre above the ground.
MovingState Level(double speed) {
  MovingState start = MovingState::Zero();
  start[Driven::kAttitude] = 1.0;
  start[Driven::kVelocity] = speed;
  start[Driven::kVelocity + 1] = speed / 3.0;
  start[Driven::kPosition + 2] = -1.0;
  return start;
}

Replay FlyBy(const NeutralVehicle& vehicle, const NeutralVehicle& pilot, double speed,
             double seconds) {
  constexpr double kEvery = 0.001;  // s
  std::vector<double> times;
  for (int k = 0; k <= std::lround(seconds / kEvery); ++k) times.push_back(k * kEvery);
  const auto commands = [&](double t) { return PulsesAt(pilot, t); };
  return Fly(Flying(vehicle), Level(speed), commands, times);
}

}  // namespace

FlyingVehicle Flying(const NeutralVehicle& vehicle) {
  const RotorVehicle stated = RotorVehicleOf(vehicle);
  const RotorExtension extension = RotorExtensionOf(EffectsOf(vehicle));
  FlyingVehicle flying{RotorAeroModel(stated.model.rotors(), vehicle.gravity, extension.effects),
                       extension.added, vehicle.Get("tau")};
  for (int i = Driven::kMoving; i < Driven::kStates; ++i) {
    flying.constants[i - Driven::kMoving] += stated.parameters[static_cast<std::size_t>(i)];
  }
  return flying;
}

FlyingVehicle ReadFlying(const std::string& path) {
  if (std::filesystem::path(path).filename() == "model.yaml") {
    const RotorModelFile model = ReadRotorModel(path);
    const RotorExtension extension = RotorExtensionOf(model.effects);
    return {RotorAeroModel(model.rotors, NeutralVehicle().gravity, extension.effects),
            model.constants + extension.added,
            model.full_speed > 0.0 ? model.constants[FindRotorConstant("motor_lag")] : 0.0};
  }
  const NeutralVehicle vehicle = ReadVehicleFiles({path}).front().vehicle;
  if (vehicle.Flies()) return Flying(vehicle);
  throw ErrorAt(path, 0, "states no mass, inertia and rotors with k_f, so that it can't be flown");
}

Replay Fly(const FlyingVehicle& vehicle, const MovingState& start, const SpeedsAt& speeds,
           const std::vector<double>& times) {
  constexpr double kReplayStep = 0.001;  // s
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  RotorState x = Joined(start, vehicle.constants);
  Replay replay{{times.front()}, {start}};
  std::vector<double> turning = speeds(times.front());
  for (std::size_t k = 1; k < times.size(); ++k) {
    const double gap = times[k] - times[k - 1];
    const int steps = std::max(1, static_cast<int>(std::ceil(gap / kReplayStep - 1e-6)));
    const double step = gap / steps;
    const double left = vehicle.tau > 0.0 ? std::exp(-step / vehicle.tau) : 0.0;
    for (int i = 0; i < steps; ++i) {
      const double t = times[k - 1] + i * step;
      const std::vector<double> wanted = speeds(t + 0.5 * step);
      for (std::size_t r = 0; r < turning.size(); ++r) {
        turning[r] = wanted[r] + left * (turning[r] - wanted[r]);
      }
      RotorMidpointStep(vehicle.model, RotorInput{t, turning}, still.data(), step, x.data());
      x.head<4>().normalize();
    }
    replay.t.push_back(times[k]);
    replay.states.push_back(x.head<RotorAeroModel::kMoving>());
  }
  return replay;
}

MeasuredFlight MeasuredStates(const FlightLog& log, int rotors, const RotorConstants& constants) {
  RotorDataOptions options;
  options.source = log.pose.empty() ? PoseSource::kMocap : PoseSource::kPose;
  options.smooth_rotors = options.weigh_speed_noise = false;
  options.pose_rate = 1e6;  // all of them
  const RotorData data = MakeRotorData(log, rotors, options);
  const double origin = ToSeconds(data.origin);
  MeasuredFlight flight{{}, data.speed_times, data.speeds};
  for (double& t : flight.speed_times) t += origin;
  for (const RotorPose& pose : data.poses) flight.states.t.push_back(origin + pose.t);
  for (const RotorNode& node : RoughNodes(data, constants)) {
    flight.states.states.push_back(node.motion);
  }
  return flight;
}

Replay FlyPulses(const NeutralVehicle& vehicle, double speed, double seconds) {
  return FlyBy(vehicle, vehicle, speed, seconds);
}

std::vector<double> PulsesAt(const NeutralVehicle& vehicle, double t) {
  // Each pulse turns the vehicle to one side and back: roll, pitch, yaw, all four.
  constexpr double kSize = 0.02, kPeriod = 0.4, kShift = 0.1;  // share of the speed, s, s
  const double hover = vehicle.Get("w_h");
  std::vector<double> speeds;
  for (const Numbers& rotor : vehicle.rotors) {
    const double sides[] = {rotor.at("y") < 0.0 ? 1.0 : -1.0, rotor.at("x") < 0.0 ? -1.0 : 1.0,
                            2.0 * rotor.at("spin"), 1.0};
    double share = 1.0;
    for (int k = 0; k < 4; ++k) {
      share += kSize * sides[k] * std::sin(2.0 * M_PI * (t - k * kShift) / kPeriod);
    }
    speeds.push_back(hover * share);
  }
  return speeds;
}

double Apart(const NeutralVehicle& a, const NeutralVehicle& b, double speed, double seconds) {
  if (a.rotors.size() != b.rotors.size() || !b.Flies()) return NAN;
  const auto end = [](const Replay& flight) {
    return flight.states.back().segment<3>(Driven::kPosition).eval();
  };
  return (end(FlyBy(a, a, speed, seconds)) - end(FlyBy(b, a, speed, seconds))).norm();
}

}  // namespace trueline
