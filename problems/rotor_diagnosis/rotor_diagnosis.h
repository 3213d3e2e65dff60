// Diagnosis of the rotor-driven model: what it gets wrong on a flight, and its name.
//
// The base fit is the batch calibration of the whole flight: constants, states at all poses, noise
// of the greatest likelihood. What an effect would push the vehicle with along the fitted flight
// (specific force, angular acceleration) becomes a column beside IMU readings and steps between
// poses, states and constants are projected out, and what is left is judged by the noise model and
// by the scatter between clusters of one second, the less certain of the two.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

struct RotorDiagnosisOptions {
  RotorCalibrationOptions calibration;
  double alpha = 0.01;  // chance of a false cause, over the whole catalogue
  int max_causes = 4;
  bool measure_gain = true;
};

// What the model leaves out between two poses: mean specific force and angular acceleration, in
// sigmas of what the flight can show, before and after the causes are in the model.
struct RotorRow {
  double t;  // s, since the log's first IMU sample
  Eigen::Matrix<double, 6, 1> before, after;
};

struct RotorDiagnosis {
  std::string verdict;  // clean | explained | ambiguous | unexplained
  std::vector<Cause> causes;
  std::vector<CandidateReport> candidates;
  std::vector<std::string> unexplained_by;    // what the residual goes with
  std::vector<ParameterEstimate> parameters;  // constants of the model with the causes in it
  RotorNoise noise;                           // learned with the causes in the model
  double rotor_delay = 0.0;                   // s, used
  double rms_before = 0.0, rms_after = 0.0;   // of `rows`
  double whiteness_p = 1.0;
  std::vector<RotorRow> rows;
  std::vector<std::string> warnings;
  int clusters = 0;
  double base_seconds = 0.0, seconds = 0.0;
};

// Causes are searched on the first flight; each counts only if it repeats on the others, where
// there are any. Throws InputError for logs without the streams that are needed, or too short.
RotorDiagnosis DiagnoseRotors(const std::vector<FlightLog>& logs,
                              const RotorDiagnosisOptions& options);

}  // namespace trueline
