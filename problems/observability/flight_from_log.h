// States and inputs along a recorded flight, from the streams of a log, for the Gramians.
#pragma once

#include <string>

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
// mocap, fixes (smoothed_path.h). Throws InputError where a stream is missing or they do not
// overlap.
NominalFlight ImuFlightFromLog(const FlightLog& log);

}  // namespace trueline
