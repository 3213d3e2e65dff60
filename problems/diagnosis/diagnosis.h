// Diagnosis: what the calibrated model gets wrong on a flight, and its name.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/catalogue.h"
#include "problems/diagnosis/score_test.h"

namespace trueline {

struct DiagnosisOptions {
  VgdOptions vgd;
  bool fit_to_mocap = false;    // mocap positions as data, beside the gates' fixes
  double mocap_interval = 0.1;  // s, between mocap positions that are used
  double mocap_sigma = 0.01;    // m
  double alpha = 0.01;          // chance of a false cause, over the whole catalogue
  int max_causes = 4;
  bool measure_gain = true;
};

// Improvement on arcs that took no part in fitting the effect's parameters.
struct Gain {
  std::string metric = "final_point_error";
  int arcs = 0;
  double before = 0.0, after = 0.0;  // m, mean final-point error
  double low = 0.0, high = 0.0;      // m, 95 % of before - after, paired bootstrap over arcs
};

struct Cause {
  Candidate candidate;
  Eigen::VectorXd value, sigma;  // of the estimated parameters
  double p = 1.0;                // after the correction for the number of candidates
  std::vector<std::string> confused_with;
  Gain gain;

  Effect effect() const { return candidate.At(value); }
};

struct CandidateReport {
  std::string id, label;
  double z = 0.0, p = 1.0;
  std::vector<std::string> parameters, units;
  Eigen::VectorXd value, sigma, detectable;
};

struct ModelParameter {
  std::string name, unit;
  double value, sigma;
};

// A fix or a sample of the accelerometer against the fit, in sigmas (as learned), before and after.
struct RowReport {
  TimeNs t;
  bool fix;  // else a force, which has x and y only
  int gate;  // -1 for none
  Eigen::Vector3d before, after;
};

struct Diagnosis {
  std::string verdict;  // clean | explained | ambiguous | unexplained
  std::vector<Cause> causes;
  std::vector<CandidateReport> candidates;
  std::vector<std::string> unexplained_by;   // what the residual goes with, strongest first
  double rms_before = 0.0, rms_after = 0.0;  // of whitened fixes
  double whiteness_p = 1.0;
  std::vector<ModelParameter> parameters;  // the model with the causes in it
  NoiseStrengths noise;
  std::vector<RowReport> rows;
  std::vector<std::string> warnings;
  double base_seconds = 0.0, seconds = 0.0;
  int clusters = 0;
};

// Throws InputError where the log can't be diagnosed.
Diagnosis Diagnose(const FlightLog& log, const DiagnosisOptions& options);

}  // namespace trueline
