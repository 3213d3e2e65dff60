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

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "problems/against/references.h"
#include "problems/log/flight_log.h"

namespace trueline {

// How the motor commands of a flight turn the vehicle, by what its reference flights show.

struct CommandResponse {
  // s: until a command acts; time constant of the motors. Both as stamps and the controller's own
  // answer to the turns let them appear, so smaller than the true ones. A command that comes after
  // a turn is never asked, though it would explain more: it answers the turn.
  double delay = 0.0, lag = 0.0;
  // Share of the flight's angular acceleration about x, y, z of the body that is explained: 1 minus
  // the mean square of what is left over the variance (R^2). Below 0: worse than its mean.
  Eigen::Vector3d explained = Eigen::Vector3d::Zero();
  // The same where the trim is that of the references, and not followed over 2 s of the past.
  Eigen::Vector3d explained_without_trim = Eigen::Vector3d::Zero();
};

// Angular acceleration, as differences of the gyroscope's means over 50 ms, is a sum of: thrust and
// change of speed of each motor (its command through delay and lag), turn rates, the vehicle's own
// momentum, and air speed along the body's axes (momentum theory's moments of first order; by
// positions and attitude). All numbers come from the references. No value where a log lacks
// commands, gyroscope or poses, or flies for less than a few seconds.
std::optional<CommandResponse> ResponseOf(const FlightLog& flight,
                                          const std::vector<const FlightLog*>& references);

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

// The result files of trueline-diagnose --against (diagnosis.yaml, trims.csv), and its table.

void WriteComparison(const Comparison& comparison, const YAML::Node& provenance,
                     const std::filesystem::path& directory);

// One row a flight, that under judgement first with session -1.
void WriteTrims(const Comparison& comparison, const std::filesystem::path& path);

// Adds the comparison to the node of a diagnosis of the whole log: causes by the trim join its
// causes, the verdict is the worse one, all else stands under `trim`.
void AddComparison(const Comparison& comparison, YAML::Node* diagnosis);

// For standard output: what is named, in words, and the trims.
std::string ComparisonTable(const Comparison& comparison);

// The flights that --log and --against name: native logs, foreign files, folders of either, globs.

struct NamedFlight {
  std::string path;
  int session = -1;  // number of the folder that it lies in; -1 where it is named itself
};

// What a list with commas names. A folder with log.yaml is a flight; another folder stands for the
// logs in it, which are of one session. Throws InputError for what is not there.
std::vector<NamedFlight> FlightsOf(const std::string& list);

// The same without the flight itself, as folders may hold it.
std::vector<NamedFlight> ReferencesOf(const NamedFlight& flight, const std::string& list);

}  // namespace trueline
