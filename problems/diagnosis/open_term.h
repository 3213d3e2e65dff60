// The open catalogue: terms that no named effect states. A grammar makes them: what a term changes,
// along which axis, and what it goes with.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "problems/diagnosis/linearisation.h"
#include "problems/effects/declaration.h"
#include "problems/effects/effect.h"

namespace trueline {

class DiagnosedFlight;  // diagnosed_flight.h
struct Found;           // candidate.h

// How the vehicle moves at one time: what a term may go with.
using TermMotion = TermState<double>;

// Known physics of this form; empty if there is none.
std::string PhysicsOf(const TermForm& term);

struct SizeWithSigma {
  double value = 0.0, sigma = 0.0;
};

// The result of a cause or term on another flight of the vehicle; see confirm.h.
struct Repeat {
  std::string log;
  std::string outcome;                     // repeats | differs | not shown | can't be tested
  Eigen::VectorXd value = {}, sigma = {};  // the estimate on that flight; empty if not testable
  double p = 1.0;                          // of the one test
};

struct DescribedTerm {
  TermForm term;
  SizeWithSigma size;  // in term.Unit(), fitted with the term in the model
  double p = 1.0;      // after the correction for the number of terms tried
  int tried = 0;
  std::array<SizeWithSigma, 2> halves = {};  // by blocks of the flight in turn, A B A B
  std::vector<std::string> alike = {};       // names of terms that fit as well
  std::string instead_of = {};  // a named cause of which little is left with the term in the model
  std::vector<Repeat> repeats = {};    // by further flight
  std::optional<bool> confirmed = {};  // as Cause::confirmed
  bool in_model = false;               // of the fit: the drive can take it
};

// One of the terms tested singly, before any is taken.
struct TermSize {
  std::string name, unit;
  SizeWithSigma size;
  double p = 1.0;  // of this test alone
};

struct OpenCatalogue {
  std::vector<DescribedTerm> described = {};
  std::vector<TermSize> tested = {};
};

// What a grammar of terms needs to know of a flight.
struct TermScope {
  DriveKind drive;
  const FlightLog& log;
  std::vector<TermMotion> motions;  // evenly in time
};

// Velocities, rates, thrust, their products and squares; rates and thrust that lag; heading; place
// on the course flown, in linear form and as humps where the flight has been, and slopes of these;
// height; time; voltage where it is logged. Series are bound.
std::vector<std::vector<TermFactor>> TermVariables(const TermScope& scope);

// Forces along horizontal axes of B and E, attitude errors and errors of fixes, for both drives.
// The rotor drive also has forces along z_B and moments: the IMU drive measures the former and has
// no latter. What goes with a part of the course acts along axes of E.
std::vector<TermForm> OpenTerms(const TermScope& scope);

// Terms that are tested jointly. They describe a residual that no effect explains and are never
// named as a cause.
struct TermGroup {
  std::string name;  // what the residual is correlated with
  std::vector<TermForm> terms;
  // Effects are sought beside it: an error of a reading, or what all vehicles have.
  bool held = false;
};
std::vector<TermGroup> TermGroups(const TermScope& scope);
// Those of all groups, one after another.
std::vector<TermForm> TermsOf(const std::vector<TermGroup>& groups);

// A size of no interest: 0.005 m/s^2, 0.05 rad/s^2, 1 mrad or 5 mm in the root mean square, and
// of readings 0.005 m/s^2 and 0.5 mrad/s. A term is reported from about five times that on.
double OrdinarySize(const TermForm& term, const std::vector<TermMotion>& flight);
// `columns`: where those of the group stand.
TermColumns TermColumnsOf(const TermGroup& group, const std::vector<TermMotion>& flight,
                          std::vector<int> columns);

// Where to look for the hump that a term on a part of the course tells about: the hump itself, or
// either side of a slope. None if the term is neither.
std::vector<TermForm> HumpsToldBy(const TermForm& term);

// A hump and those near it: moved by `step` of its radius, wider and narrower by as much, or with
// another edge, where the flight has been.
std::vector<TermForm> NearbyHumps(const TermForm& hump, const std::vector<TermMotion>& flight,
                                  double step);

// Forward selection of at most a few terms on the flight's last Fit, whose causes are `found`. A
// term is described if it is significant at `alpha` over all terms, by the noise and by the scatter
// between clusters, and if each half of the flight predicts the other half better with the size
// that it shows. Of terms that fit alike, the shortest formula is taken. Each is fitted like a
// cause, and added to `found`, before the next one is searched; a term that is then no longer
// significant is dropped.
OpenCatalogue DescribeMisfit(DiagnosedFlight* flight, std::vector<Found>* found, double alpha);

}  // namespace trueline
