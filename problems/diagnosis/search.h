// The search for causes on one flight: base fit, tests of all candidates, refits with those found.
#pragma once

#include <memory>

#include "problems/diagnosis/diagnosis.h"
#include "problems/diagnosis/sensitivity.h"

namespace trueline {

// A cause under refinement.
struct Found {
  Candidate candidate;
  Eigen::VectorXd value;
};

// A candidate with what a test under its own noise says.
struct Tested {
  Candidate candidate;
  Eigen::MatrixXd columns;
  Eigen::VectorXd ordinary;
  ScoreTest test;
  double gain = 0.0;  // twice the increase of the log likelihood, noise learned anew
  double p = 1.0;     // corrected for the candidates of the same id

  // Gain less what as many parameters of no meaning would give (Akaike).
  double Merit() const { return gain - 2.0 * static_cast<double>(test.value.size()); }
};

inline Eigen::VectorXd ValueOf(const Tested& t) { return t.candidate.Neutral() + t.test.value; }

// A model from a part of a flight.
struct PartFit {
  ThetaVector value, sigma;  // physical parameters
  std::vector<Effect> effects;
};

class CauseSearch {
 public:
  // `log` must outlive this.
  CauseSearch(const FlightLog& log, const VgdOptions& options);

  // Solves with the causes in the model (their values are refined), noise learned anew.
  void Fit(std::vector<Found>* found, int refits);
  // All candidates on top of the last Fit.
  std::vector<Tested> TestAll(const std::vector<Candidate>& candidates);
  // Columns that are no effect's, tested likewise; probability and merit of each.
  struct Described {
    std::string name;
    double p, merit;
    Eigen::MatrixXd columns;
  };
  std::vector<Described> TestLibrary();
  // One cause of the last Fit against the model without it, the others kept; `beside` (rows x any)
  // are columns of no effect that may explain the residual as well.
  ScoreTest TestFound(const std::vector<Found>& found, std::size_t which,
                      const Eigen::MatrixXd& beside) const;
  ScoreTest TestFound(const std::vector<Found>& found, std::size_t which) const;
  // The model of the last Fit from the clusters that `used` names alone.
  PartFit FitOf(const std::vector<Found>& found, const std::vector<bool>& used) const;

  const BaseFit& fit() const { return fit_; }
  const std::vector<Effect>& effects() const { return effects_; }
  BaseFlight& flight() { return *flight_; }
  const FlightPlan& plan() const { return plan_; }
  // Physical parameters (kThetaSize) with their sigmas.
  ThetaVector Parameters() const;
  ThetaVector Sigmas() const;
  // Whitened measurement residuals of the last fit.
  Eigen::VectorXd Whitened() const;
  // Velocity along the last fit.
  const std::vector<VelocitySample>& path() const { return path_; }

 private:
  void StorePath();
  int FilterColumns() const;  // nuisances for an ordinary attitude filter; they come first
  void Rebuild(const std::vector<Found>& found);
  void FitFromHere(std::vector<Found>* found, int refits);
  bool IsSound() const;
  void TestTogether(std::vector<Tested>* tested) const;
  void RelearnBest(std::vector<Tested>* tested) const;
  void LearnUnder(double base_evidence, int sweeps, Tested* tested) const;
  int nuisances() const { return kThetaSize + fit_.columns.count(); }

  const FlightLog& log_;
  VgdOptions options_;
  FlightData data_;
  FlightPlan plan_;
  std::vector<Effect> effects_;
  std::vector<VelocitySample> path_;
  FlightLog corrected_;
  std::unique_ptr<BaseFlight> flight_;
  BaseFit fit_;
  bool started_ = false;
};

}  // namespace trueline
