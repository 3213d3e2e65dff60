// States and inputs along a recorded flight, from the streams of a log, for the Gramians.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

// Rotor-driven: attitude from mocap, pose or AHRS (the first there is), rates from the gyro, inputs
// from rotors.csv. Position and velocity do not enter the sensitivities and stay zero. Throws
// InputError where attitude or rotor speeds are missing or do not overlap in time.
NominalFlight RotorFlightFromLog(const FlightLog& log, const RotorVehicle& vehicle);

inline constexpr double kMocapSigma = 0.01;  // m, each axis

// IMU-driven (Li et al. 2019): attitude from the AHRS, or from the program's own filter where none
// is logged; thrust-axis acceleration from the IMU; velocity from mocap positions or, without
// mocap, fixes (SmoothPath). Throws InputError where a stream is missing or they do not
// overlap.
NominalFlight ImuFlightFromLog(const FlightLog& log);

// The velocity along a flight whose position is known at times. Between them the accelerometer is
// integrated in the direction that the attitude gives (eq. 6: dv_E/dt = R_E_I f_I + g_E). A Kalman
// filter and Rauch-Tung-Striebel smoother weigh positions by their sigmas: their noise must not
// pass for motion, which would excite the parameters.

struct PositionReading {
  TimeNs t;
  Eigen::Vector3d p_E;
  double sigma;  // m, each axis
};

struct SmoothedPath {
  double start = 0.0, step = 0.0;    // s
  std::vector<Eigen::Vector3d> v_E;  // m/s, every step
  double sigma = 0.0;                // m/s, of a velocity on each axis; root mean square
  double heading = 0.0;  // rad, psi_E_Ep: of the attitude's earth frame; 0 if the motion shows none

  Eigen::Vector3d VelocityAt(double t) const;
};

// `positions` and `attitude` ascend in time; none of the streams is empty.
SmoothedPath SmoothPath(const std::vector<ImuSample>& imu,
                        const std::vector<AttitudeSample>& attitude,
                        const std::vector<PositionReading>& positions, double gravity);

}  // namespace trueline
