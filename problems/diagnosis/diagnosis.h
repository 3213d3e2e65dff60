// Diagnosis: which effects the calibrated model lacks on a flight. It is the same for all drives;
// each brings a DiagnosedFlight (diagnosed_flight.h).
#pragma once

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "problems/diagnosis/candidate.h"
#include "problems/diagnosis/open_term.h"
#include "problems/result/estimate.h"

namespace trueline {

class DiagnosedFlight;  // diagnosed_flight.h
struct Misfit;          // misfit.h

// A flight of the drive, fitted without causes. Throws InputError if the log cannot be diagnosed.
using MakeFlight = std::function<std::unique_ptr<DiagnosedFlight>(const FlightLog& log)>;

struct SearchOptions {
  double alpha = 0.01;  // chance of a false cause, over the whole catalogue
  bool measure_gain = true;
  // The further flights are references: a cause is what differs from them, not what repeats.
  bool against = false;
};

// Improvement on held-out arcs (or replays): parameters and causes are fitted without them.
struct Gain {
  int arcs = 0;
  double before = 0.0, after = 0.0;  // mean error
  // 95 % of before - after, paired bootstrap; not finite if there are too few arcs.
  double low = -INFINITY, high = INFINITY;
  std::string metric = "final_point_error";
  std::string unit = "m";
};

// By arcs, and by replays over a second; none of these without mocap.
struct Gains {
  Gain arcs, replays;
};

// Sizes of an effect, with their standard deviations.
struct SizeEstimate {
  Eigen::VectorXd value, sigma;
};

// What another stream says of a cause's size, without the fit (witness.h).
struct Witness {
  std::string stream;            // mocap attitude, ...; empty if there is none
  std::string says = "silent";   // confirms | refutes | silent
  Eigen::VectorXd value, sigma;  // of the estimated parameters; empty if the stream can't tell
  std::string text;              // both sizes, or why there is no witness
  bool independent = true;       // of what was fitted
};

// Natural logarithms of likelihood ratios of a cause against none, by source (evidence_sum.h).
struct EvidenceSum {
  double flight = 0.0;         // what was fitted
  double held_out = 0.0;       // flight that took no part, where it is predicted worse
  double witness = 0.0;        // another stream of the log
  double other_flights = 0.0;  // further logs
  double prior = 0.0;          // one of as many candidates

  double Total() const { return flight + held_out + witness + other_flights + prior; }
  std::vector<std::pair<const char*, double>> Parts() const {
    return {{"flight", flight},
            {"held-out flight", held_out},
            {"witness", witness},
            {"other flights", other_flights},
            {"prior", prior}};
  }
};

struct Cause {
  Candidate candidate;
  Eigen::VectorXd value, sigma;  // of the estimated parameters
  double p = 1.0;                // after the correction for the number of candidates
  std::vector<std::string> confused_with = {};
  Gains gains = {};                    // against the model with the other causes alone
  std::vector<Repeat> repeats = {};    // by further flight
  std::optional<bool> confirmed = {};  // by most further flights; empty if none can tell
  Witness witness = Witness();
  // Of the distance between the witness's stream and mocap once the cause is corrected, likewise.
  Gain agreement = Gain();
  // Of the value: what an error that no hypothesis states adds, on a flight that shows one.
  std::optional<Eigen::VectorXd> unstated_sigma = {};
  bool shared = false;           // with the references: part of the model, and no change
  bool beside_any_path = false;  // false data that no misfit of the model imitates
  EvidenceSum evidence = {};
  std::string because = {};  // why it is set aside; empty if it is named

  Effect effect() const { return candidate.At(value); }
  Eigen::VectorXd Unstated() const { return unstated_sigma.value_or(0.0 * value); }
};

struct CandidateReport {
  std::string id, label;
  double z = 0.0, p = 1.0;
  Eigen::VectorXd value = {}, sigma = {}, detectable = {};

  const std::vector<EffectParameterInfo>& parameters() const { return InfoOf(id).parameters; }
};

// Whitened residuals of a fit, in learned sigmas.
struct Residuals {
  struct Row {
    double t;          // s
    const char* kind;  // fix, force, ...
    int gate;          // -1 for none
    Eigen::Vector3d sigmas;
  };
  std::vector<Row> rows;
  double rms = 0.0;          // of the rows that the drive judges a model by
  double whiteness_p = 1.0;  // WhitenessOf
};

struct Diagnosis {
  std::string verdict;  // clean | explained | ambiguous | unexplained
  std::vector<Cause> causes;
  std::vector<Cause> set_aside;  // significant, but not named: `because` says why
  Gains gains;                   // of all causes together
  std::vector<CandidateReport> candidates;
  std::vector<std::string> against;         // folders of the references
  std::vector<std::string> not_shown;       // effects whose detectable size no vehicle has
  std::vector<std::string> unexplained_by;  // variables correlated with the residual
  OpenCatalogue open;                       // terms beyond the causes
  Gains terms_gains;                        // of all terms in the fit, against the causes alone
  Residuals before, after;                  // the causes; `rms` before with false data
  // What model.yaml holds: the causes that can be relied on, the constants fitted with them, and
  // why it lacks other causes.
  std::vector<Effect> in_model;
  std::vector<ParameterEstimate> parameters;
  std::string model_lacks;
  double evidence_needed = 0.0;  // of a cause that is named
  std::shared_ptr<const Misfit> misfit;
  std::vector<std::string> warnings;
  std::string log = "LOG", folder = "RESULT", flags;  // as the user gave them, for what to do next
  std::vector<std::string> log_faults;  // that make constants wrong, found before the fit
  double base_seconds = 0.0, seconds = 0.0;
  // What only one drive reports.
  std::string drive;        // key `drive` of the file; empty: none
  std::string residual_of;  // what `rms` is of, in words
  std::string fixes;        // how those of a flight without gates were divided
  YAML::Node noise;         // learned with the causes in the model
  std::optional<double> rotor_delay, gyro_delay;  // s, used
};

// Searches causes on the first flight. Where there are further flights, a cause must repeat on
// them. Throws InputError if a log cannot be diagnosed.
Diagnosis Diagnose(const std::vector<FlightLog>& logs, const MakeFlight& make,
                   const SearchOptions& options);

}  // namespace trueline
