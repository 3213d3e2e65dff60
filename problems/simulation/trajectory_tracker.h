// Flies a trajectory in flat outputs: feed-forward of attitude, rates and moments from the flat
// map, feedback on SE(3) (Lee, Leok and McClamroch 2010). Rotor speeds fed forward alone diverge
// within seconds.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "problems/simulation/airframe.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline::simulation {

struct TrackerGains {
  double position = 9.0;   // 1/s^2
  double velocity = 5.0;   // 1/s
  double attitude = 10.0;  // 1/s
  double rate = 25.0;      // 1/s
};

class TrajectoryTracker {
 public:
  // `step`: s between commands. `min_speed`, `max_speed`: rad/s, saturation of the rotors. `lag`:
  // s, of the rotor speed behind the command.
  TrajectoryTracker(const RotorFlight& flight, double gravity, double step, double min_speed,
                    double max_speed, double lag, const TrackerGains& gains = {});

  int num_steps() const { return static_cast<int>(wanted_.size()) - 1; }
  // State of the reference at its start, rotors at the reference's speeds.
  BodyState Start() const;
  // Rotor speeds (rad/s) wanted at the beginning of step `k`.
  RotorArray Command(int k, const BodyState& state) const;
  // Position of the reference at step `k`, m.
  const Vector3d& PositionAt(int k) const { return wanted_[k].p_E; }

 private:
  struct Wanted {
    Vector3d p_E, v_E, a_E;
    Quaterniond q_E_B;
    Vector3d w_B, dw_B;
    double yaw;
    RotorArray rotors;
  };
  static Wanted Sample(const RotorFlight& flight, double t);
  RotorArray SpeedsFor(double thrust, const Vector3d& moment) const;

  FlatVehicle vehicle_;
  double gravity_, min_speed_, max_speed_;
  int lead_;  // steps
  TrackerGains gains_;
  std::vector<Wanted> wanted_;
};

}  // namespace trueline::simulation
