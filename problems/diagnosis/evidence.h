// Evidence of a linearised fit for candidates and for terms that are no effect: each singly, and
// effects in pairs.
#pragma once

#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/score_test.h"

namespace trueline {

// Gain less that of the same number of spurious parameters (Akaike).
inline double AkaikeMerit(double gain, Eigen::Index parameters) {
  return gain - 2.0 * static_cast<double>(parameters);
}

struct Tested {
  Candidate candidate;
  EffectColumns columns;
  ScoreTest test;            // in units of the columns
  Eigen::VectorXd value;     // estimate by one Gauss-Newton step from the fit
  double linear_gain = 0.0;  // twice the increase of the log likelihood, with the fit's noise
  double gain = 0.0;         // the same with noise learned again
  double p = 1.0;            // corrected for the candidates of the same id
  int tried = 1;             // of them
  std::vector<std::string> confused = {};  // ids that fit as well; set by Explain

  double Merit() const { return AkaikeMerit(gain, value.size()); }
  double LinearMerit() const { return AkaikeMerit(linear_gain, value.size()); }
  bool IsOf(const std::string& id) const { return candidate.id() == id; }
  bool Significant(double alpha) const { return p < alpha && Plausible(candidate, value); }
};

// Two effects tested together, each given the other.
struct TestedPair {
  Tested first, second;
  double merit;  // of both together

  bool Has(const std::string& id) const { return first.IsOf(id) || second.IsOf(id); }
  std::vector<int> Columns() const {
    return Concatenated(first.columns.columns, second.columns.columns);
  }
};

// A term, or an effect of an impossible size, that the residual is correlated with.
struct TestedTerm {
  std::string name;
  double p;      // corrected for the number of terms, or of effects
  double merit;  // as Tested::Merit
  bool held;
  std::vector<int> columns;  // none for an effect
  Eigen::VectorXd ordinary = {};

  // True if significant and of a merit clearly greater than `than`.
  bool Exceeds(double alpha, double than) const;
};

class FlightEvidence {
 public:
  // Where held terms, such as errors of a sensor's readings, explain clearly more than any effect,
  // effects are tested given those terms.
  // `alpha`: chance, over all terms, of such a term that is not there.
  FlightEvidence(const DiagnosedFlight& flight, const std::vector<Candidate>& candidates,
                 double alpha);

  const Linearisation& fit() const { return *fit_; }
  const std::vector<Candidate>& candidates() const { return candidates_; }
  const std::vector<Tested>& tested() const { return tested_; }
  const std::vector<TestedTerm>& terms() const { return terms_; }  // strongest first
  // Leaves an effect out of what follows.
  void Exclude(const EffectInfo& info);
  // The best candidate of each effect; rotor_loss counts rotor by rotor.
  std::vector<const Tested*> BestOfEach() const;
  // Pairs of effects whose joint merit with the fit's noise exceeds `merit` and of which each is
  // significant given the other. Of a step effect only the best time takes part.
  std::vector<TestedPair> Pairs(double alpha, double merit) const;

 private:
  void TestEach();
  void TestTerms(bool held, double merit, double alpha);
  void RelearnBest();
  void RelearnBest(std::vector<TestedPair>* pairs) const;
  void AddImplausible();

  std::vector<Candidate> candidates_;
  std::unique_ptr<Linearisation> fit_;
  std::vector<int> beside_;  // nuisance columns in each test
  std::vector<Tested> tested_;
  std::vector<TestedTerm> terms_;
};

// Which effect, or which pair of effects, best explains the residuals of a fit.
struct Explanation {
  std::vector<Tested> effects;  // none, one or two
  double merit = 0.0;           // of them; of one of them with a second one if that is more
};

// Of effects that fit equally well, chooses the one with the fewest parameters. One effect is more
// likely than two, so a pair is chosen only if it explains clearly more than the best single
// effect, alone or in any pair. One effect with many parameters can fit as well as two with few:
// drag along three axes fits like blade drag and inflow while rotor speeds hardly change. The two
// are then listed among the effects that the one is confused with.
Explanation Explain(const FlightEvidence& evidence, double alpha);

}  // namespace trueline
