// One flight against the references of its vehicle: what has changed, by the trim.
//
// Statics of a vehicle in level flight: a rotor that gives `factor` times its thrust needs the
// command 1/factor times as large and changes no other; a thrust scale of all rotors, or a mass,
// changes all commands alike. A load that hangs in the stream of a rotor has the trim of that rotor
// being weak: its weight pulls there and its drag takes the moment of the extra thrust. So each
// cause comes with the load that it can't be told from.
//
// A few flights do not show how far flights scatter, so deviations have the tails of Student's t.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/against/command_response.h"
#include "problems/against/references.h"

namespace trueline {

// Of the flight and the references: unknown, or stated to be the same (one day, nothing rebuilt).
enum class SessionOfFlight { kUnknown, kSame };

struct ComparisonRules {
  UsualScatter usual;
  double alpha = 0.01;  // chance of naming a cause where nothing has changed
};

// What the flight should show if nothing has changed: ln(command) with its covariance.
struct TrimForecast {
  Eigen::VectorXd mean;
  Eigen::MatrixXd cov;
  double dof = 0.0;  // degrees of freedom that `cov` is known by
};

// A change that was tried.
struct TriedCause {
  std::string id;               // rotor_loss, or thrust_scale of all channels
  std::vector<int> channels;    // from 0, the greater change first
  Eigen::VectorXd size, sigma;  // of ln(command), by channel of `channels`, or of all
  // Of one flight of a session about the session's mean.
  Eigen::VectorXd sigma_flight;
  double evidence = 0.0;  // ln of the likelihood ratio at this size against no change
  double p = 1.0;         // of the evidence by chance, for all that was tried
  double misfit_p = 1.0;  // of what it leaves

  // Orders causes, proven or not: each size that is fitted costs half its degree of freedom.
  double Score() const { return evidence - 0.5 * static_cast<double>(size.size()); }
};

// A load that has the same trim: a share of the vehicle's mass, placed under the channels.
struct AlikeLoad {
  double share = 0.0, sigma = 0.0;
};

struct Findings {
  std::vector<TriedCause> tried;  // best score first
  std::optional<TriedCause> named;
  std::vector<TriedCause> alike;  // others that fit as well as the first
  double misfit_p = 1.0;          // of the trim against no change
};

struct Comparison {
  CommandTrim flight;
  std::vector<CommandTrim> others;
  References references;
  SessionOfFlight session = SessionOfFlight::kUnknown;
  double alpha = 0.0;
  bool by_mass = false;  // all flights state their mass, so commands are by mass
  TrimForecast forecast;
  Eigen::VectorXd ln_command;  // of the flight
  Findings findings;
  Findings if_same_session;  // what --session=same would say
  std::optional<CommandResponse> response;
  // clean | ambiguous | unexplained: a load always explains as well as what is named.
  std::string verdict;
  std::vector<std::string> log_faults;
  std::vector<std::string> warnings;

  AlikeLoad LoadOf(const TriedCause& cause) const;
  // To be named: sigmas of a cause of one size, evidence of the first cause.
  double SigmasNeeded() const;
  double EvidenceNeeded() const;
};

// Throws InputError if the flight and the references, one or more, differ in their channels.
Comparison Compare(const CommandTrim& flight, const std::vector<ReferenceFlight>& references,
                   SessionOfFlight session, const ComparisonRules& rules = {});

}  // namespace trueline
