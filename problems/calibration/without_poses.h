// Calibration of the rotor drive without poses: what the IMU and motor commands, or rotor speeds,
// show alone.
#pragma once

#include <string>
#include <vector>

#include "problems/calibration/calibration.h"
#include "problems/calibration/rotor_calibration.h"

namespace trueline {

struct PoselessCalibration {
  // Those that the flight shows: motor_lag [s]; hover_command (mean) and thrust_slope [1], thrust's
  // relative change by command; k_f [1, of the nominal] by rotor speeds; I_x, I_y [kg m^2] beside
  // the vehicle's mass and places of rotors; k_m/(k_f I_z) [1/(kg m)].
  std::vector<ParameterEstimate> parameters;
  std::vector<std::string> not_shown;  // in words, with the reason
  Verdict verdict;
};

// One-step predictions of thrust and turn rates by the lagged squares of the rotors' speeds, which
// feedback does not bias (Ljung 1999, 13.4: the direct approach), and a jackknife over parts of the
// flight. Throws InputError for a log without the vehicle's rotors, or one too short or too slow.
PoselessCalibration CalibrateWithoutPoses(const FlightLog& log,
                                          const RotorCalibrationOptions& options);

// calibration.yaml, and the table for standard output.
void WriteCalibration(const PoselessCalibration& calibration, const YAML::Node& provenance,
                      const std::filesystem::path& directory);
std::string CalibrationTable(const PoselessCalibration& calibration);

}  // namespace trueline
