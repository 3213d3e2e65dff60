// What a diagnosis needs of a drive: its catalogue, its fit with given causes, the linearised fit
// with columns for effects, replays, and what it reports. Rounds, tests, gains, confirmation and
// files are the same for all drives.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/diagnosis.h"
#include "problems/diagnosis/linearisation.h"
#include "problems/diagnosis/open_term.h"
#include "problems/log/flight_log.h"

namespace trueline {

// Of a replay: simulation without correction from a fitted state.
struct ReplayError {
  int segment;     // of the fit's chain, where it starts
  double horizon;  // s
  TimeNs end;
  Eigen::Vector3d error_E;  // m, simulated less measured displacement
  Eigen::Vector3d error_B;  // m, in body axes at the end
};

// Variables that a replay's error may be correlated with, at the replay's middle.
struct ReplaySituation {
  double time, speed, acceleration = 0.0, thrust, rate;  // s, m/s, m/s^2, m/s^2, rad/s
  double heading, gate_distance = NAN, height, battery;  // rad, m, m, V; NAN: not logged
  int gate = -1;       // of the nearest fix within a second; -1: none
  double north, east;  // m
};

// Distances between a corrected stream and mocap, by second.
struct StreamErrors {
  std::string unit;
  std::map<int, double> by_second;
};

// Errors (m) by place, each predicted with constants and causes fitted to the other half of the
// flight.
struct HeldOutErrors {
  std::map<int, double> arcs;                   // by cluster
  std::map<int, double> replays;                // of a second, by the segment where they start
  std::string metric = "final_point_error";     // of `arcs`
  std::map<std::string, StreamErrors> streams;  // by witness (Witness::stream)
};

// Fits with causes that a flight keeps: a search that rejects a cause returns to the one before it.
inline constexpr std::size_t kMostKept = 6;
// Of replays, s.
inline constexpr double kReplayHorizons[] = {0.25, 0.5, 1.0, 2.0}, kHeldOutHorizon = 1.0;

class DiagnosedFlight {
 public:
  virtual ~DiagnosedFlight() = default;

  virtual DriveKind drive() const = 0;
  virtual const FlightLog& log() const = 0;                // as recorded
  virtual const FlightLog& data() const { return log(); }  // as fitted, with the attitude used
  virtual CatalogueScope Scope() const = 0;
  std::vector<Candidate> AllCandidates() const { return CandidatesFor(drive(), Scope()); }
  virtual std::vector<VelocitySample> Path() const { return {}; }  // of the last Fit, if it has one

  // Solves with the causes in the model, refines their values and learns the noise again.
  virtual void Fit(std::vector<Found>* found) = 0;
  // The last Fit with columns for its causes, for `candidates` at their neutral values, and for
  // the drive's terms. It must not outlive the flight.
  virtual std::unique_ptr<Linearisation> Linearise(const std::vector<Candidate>& candidates,
                                                   bool terms) const = 0;
  // Of --model, which every fit has and model.yaml keeps.
  virtual std::vector<Effect> KnownEffects() const = 0;
  // True if a term can be fitted as a cause is.
  virtual bool CanModel(const TermForm& term) const = 0;
  // How the vehicle moves along the last Fit, evenly in time.
  virtual std::vector<TermMotion> Motions() const = 0;
  // The last Fit, whose constants, ordinary errors and causes are `nuisances`, with a column for
  // one unit of each term.
  virtual std::unique_ptr<Linearisation> LineariseTerms(
      const std::vector<TermForm>& terms) const = 0;
  // Names of the constants, the first columns of Linearise.
  virtual std::vector<std::string> Constants() const = 0;
  // False if constants that are fitted together with this cause have an unphysical value.
  virtual bool ConstantsArePhysical(const Found&) const { return true; }
  // Descriptions of learned noise far beyond that of ordinary flights. It is no effect, but such a
  // flight is not clean.
  virtual std::vector<std::string> ExtraordinaryNoise() const = 0;

  // The same flight fitted without causes: for another search; and to measure gains against, under
  // one noise for all models.
  virtual std::unique_ptr<DiagnosedFlight> WithoutCauses() const = 0;
  virtual std::unique_ptr<DiagnosedFlight> Reference() const { return WithoutCauses(); }
  // Of the model of the last Fit, whose causes are `found`. `with_false_data`: false data count as
  // data.
  virtual HeldOutErrors ErrorsHeldOut(const std::vector<Found>& found,
                                      bool with_false_data) const = 0;

  // Data that no effect on all data explains: fixes of another object than the gate. Needs a fit
  // without causes.
  virtual std::optional<Cause> FindFalseData(double /*alpha*/) const { return std::nullopt; }
  // The same flight without the data of FindFalseData, fitted without causes.
  virtual std::unique_ptr<DiagnosedFlight> WithoutFalseData(double /*alpha*/) const {
    return WithoutCauses();
  }
  // The entry for `found` in the list of candidates; none if the flight has no such data.
  virtual std::optional<CandidateReport> ReportFalseData(const std::optional<Cause>& /*found*/,
                                                         double /*alpha*/) const {
    return std::nullopt;
  }

  virtual Residuals WhitenedResiduals() const = 0;
  // Simulations with the model of the last Fit, and how the vehicle flew during one of them.
  virtual std::vector<ReplayError> ReplayOpenLoop() const = 0;
  virtual std::string ReplaysAgainst() const = 0;  // what they are compared with
  virtual ReplaySituation SituationOf(const ReplayError& replay) const = 0;
  // Adds the fitted constants, the noise and what else only this drive reports.
  virtual void Describe(Diagnosis* diagnosis) const = 0;
};

}  // namespace trueline
