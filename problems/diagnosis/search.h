// The search for causes on one flight: base fit, tests of all candidates, refits with those found.
#pragma once

#include <memory>

#include "problems/diagnosis/diagnosis.h"
#include "problems/diagnosis/sensitivity.h"

namespace trueline {

// A cause whose value is being refined.
struct Found {
  Candidate candidate;
  Eigen::VectorXd value;
};

// A candidate with its test under its own noise.
struct Tested {
  Candidate candidate;
  Eigen::MatrixXd columns;
  Eigen::VectorXd ordinary;
  ScoreTest test;
  double gain = 0.0;  // twice the increase of the log likelihood, noise learned again
  double p = 1.0;     // corrected for the candidates of the same id

  // Gain less that of the same number of spurious parameters (Akaike).
  double Merit() const { return gain - 2.0 * static_cast<double>(test.value.size()); }
};

inline Eigen::VectorXd ValueOf(const Tested& t) { return t.candidate.Neutral() + t.test.value; }

// A model fitted to a part of a flight.
struct PartFit {
  ThetaVector value, sigma;  // physical parameters
  std::vector<Effect> effects;
};

class CauseSearch {
 public:
  // `log` must outlive this.
  CauseSearch(const FlightLog& log, const VgdOptions& options);

  // Solves with the causes in the model, refines their values and learns the noise again.
  void Fit(std::vector<Found>* found, int refits);
  // Tests all candidates given the last Fit.
  std::vector<Tested> TestAll(const std::vector<Candidate>& candidates);
  // p-value and merit of columns that belong to no effect, tested likewise.
  struct Described {
    std::string name;
    double p, merit;
    Eigen::MatrixXd columns;
  };
  std::vector<Described> TestLibrary();
  // Tests one cause of the last Fit against the model without it, the others kept. `beside` (rows x
  // any): nuisance columns of no effect that may explain the residual as well.
  ScoreTest TestFound(const std::vector<Found>& found, std::size_t which,
                      const Eigen::MatrixXd& beside) const;
  ScoreTest TestFound(const std::vector<Found>& found, std::size_t which) const;
  // The model of the last Fit refitted to the clusters in `used` only.
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
  int FilterColumns() const;  // nuisances of an ordinary attitude filter; they come first
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
