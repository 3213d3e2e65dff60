// Diagnosis of the rotor-driven model: which effects it lacks on a flight.
//
// The base fit is the batch calibration of the whole flight: constants, states at all poses, noise
// of the greatest likelihood. The forces (specific force, angular acceleration) that an effect
// would add along the fitted flight become a column of the linearised fit. States and constants are
// nuisance parameters and projected out. Each test uses the less certain of two variances: that of
// the noise model, and that of the scatter between clusters of one second.
#pragma once

#include "problems/rotor_diagnosis/rotor_search.h"

namespace trueline {

struct RotorDiagnosisOptions {
  RotorCalibrationOptions calibration;
  double alpha = 0.01;  // chance of any false cause, over the whole catalogue
  int max_causes = 4;
  bool measure_gain = true;
};

// The unmodelled force between two poses: mean specific force and angular acceleration, in sigmas
// of what the flight resolves, before and after the causes enter the model.
struct RotorRow {
  double t;  // s, since the log's first IMU sample
  Eigen::Matrix<double, 6, 1> before, after;
};

struct RotorDiagnosis {
  std::string verdict;  // clean | explained | ambiguous | unexplained
  std::vector<Cause> causes;
  std::vector<CandidateReport> candidates;
  std::vector<std::string> unexplained_by;    // variables correlated with the residual
  std::vector<ParameterEstimate> parameters;  // constants, fitted with the causes in the model
  RotorNoise noise;                           // learned with the causes in the model
  double rotor_delay = 0.0;                   // s, used
  double rms_before = 0.0, rms_after = 0.0;   // of `rows`
  double whiteness_p = 1.0;
  std::vector<RotorRow> rows;
  std::vector<std::string> warnings;
  int clusters = 0;
  double base_seconds = 0.0, seconds = 0.0;
};

// Searches causes on the first flight. Where there are further flights, a cause must repeat on
// them. Throws InputError for logs that lack a required stream or are too short.
RotorDiagnosis DiagnoseRotors(const std::vector<FlightLog>& logs,
                              const RotorDiagnosisOptions& options);

}  // namespace trueline
