// The flight models of simulators, written from their equations and apart from problems/simulators:
// each reads its own file with a parser of the format and flies it. Axes are the simulators': body
// forward-left-up, world z up.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace trueline::replay {

struct State {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();  // m, m/s, world
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();                     // body to world
  Eigen::Vector3d w = Eigen::Vector3d::Zero();                               // rad/s, body
};

struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
};

// A simulator with a vehicle loaded. `drive` moves the actuators (speeds, or shares of thrust) by
// commands in rad/s over dt; `wrench` is about the centre of mass, in body axes.
struct Simulator {
  double mass = 0.0, gravity = 9.81;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> rotors;  // from the centre of mass
  std::function<void(const std::vector<double>& commands, double dt, std::vector<double>* state)>
      drive;
  std::function<Wrench(const std::vector<double>& state, const State& body)> wrench;
  // Of commands that stand.
  std::function<std::vector<double>(const std::vector<double>& commands)> settled;
};

Simulator LoadRotorPy(const std::filesystem::path& file);
Simulator LoadGazebo(const std::filesystem::path& file, bool classic);
// Thrust by command: `full_speed` (rad/s) is what a command of 1 stands for.
Simulator LoadSih(const std::filesystem::path& file, double full_speed);
Simulator LoadGymPybullet(const std::filesystem::path& file);
Simulator LoadPyFlyt(const std::filesystem::path& yaml, const std::filesystem::path& urdf);
Simulator LoadMujoco(const std::filesystem::path& file, double full_speed);
Simulator LoadCrazyflow(const std::filesystem::path& file);
Simulator LoadFlightmare(const std::filesystem::path& file);
// The C++ and Python that an export writes, read by their statements.
Simulator LoadAirSim(const std::filesystem::path& file, double full_speed);
Simulator LoadIsaacLab(const std::filesystem::path& file, double full_speed);
Simulator LoadRotorS(const std::filesystem::path& file);

// States every millisecond over `seconds`, by commands (rad/s) at a time.
std::vector<State> Fly(const Simulator& simulator, State start,
                       const std::function<std::vector<double>(double t)>& commands,
                       double seconds);

// The same by a pilot who sees the state; with the actuators' states and the specific force (m/s^2,
// body) at those times.
using Pilot = std::function<std::vector<double>(double t, const State& state)>;
struct Flight {
  std::vector<State> states;
  std::vector<std::vector<double>> actuators;
  std::vector<Eigen::Vector3d> force;
};
Flight FlyWith(const Simulator& simulator, State start, const Pilot& pilot, double seconds);

}  // namespace trueline::replay
