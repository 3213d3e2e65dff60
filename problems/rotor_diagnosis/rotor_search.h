// The search for causes on one rotor-driven flight: base fit, tests of all candidates, refits with
// those found.
#pragma once

#include <memory>
#include <optional>

#include "problems/diagnosis/diagnosis.h"
#include "problems/rotor_diagnosis/rotor_evidence.h"

namespace trueline {

inline constexpr double kRotorCluster = 1.0;  // s, over which residuals may be correlated

// A cause whose value is being refined.
struct RotorFound {
  Candidate candidate;
  Eigen::VectorXd value;
};

class RotorSearch {
 public:
  // Learns noise and delay of the rotor speeds as a calibration does. `log` must outlive this
  // object.
  RotorSearch(const FlightLog& log, const RotorCalibrationOptions& options);
  // Starts with the noise and delay that another search has learned.
  RotorSearch(const RotorSearch& other, const FlightLog& log)
      : log_(log), options_(other.options_), stated_(other.stated_) {}

  // Solves with the causes in the model, refines their values, then learns the noise again.
  void Fit(std::vector<RotorFound>* found);
  // Solves with the causes held at their values.
  void Refit(const std::vector<RotorFound>& found);
  // Tests all candidates and the library's terms given the last Fit.
  RotorEvidence TestAll(const std::vector<Candidate>& candidates) const;
  // Tests the candidates only.
  std::vector<RotorTested> Test(const std::vector<Candidate>& candidates) const;
  // Tests one cause of the last Fit against the model without it, the other causes kept; values in
  // the cause's units.
  ScoreTest TestFound(const std::vector<RotorFound>& found, std::size_t which) const {
    return TestFoundBeside(found, which, *normal_, {});
  }
  // The same with nuisance columns (counted from 0) of `normal`, whose first columns are the
  // causes'.
  ScoreTest TestFoundBeside(const std::vector<RotorFound>& found, std::size_t which,
                            const RotorNormal& normal, std::vector<int> beside) const;

  const RotorCalibrationOptions& options() const { return options_; }
  const RotorNoise& noise() const { return options_.noise; }
  const RotorWorld& world() const { return *world_; }
  const RotorBatchResult& batch() const { return batch_; }
  RotorBatchOptions BatchOptions() const;
  // The last fit, linearised, with the columns of the found causes.
  const RotorNormal& normal() const { return *normal_; }
  int clusters() const { return normal_->clusters(); }

 private:
  std::vector<RotorVariant> VariantsFor(const Candidate& candidate, const Eigen::VectorXd& value,
                                        const std::vector<Effect>& others) const;
  bool Step(std::vector<RotorFound>* found) const;
  RotorEvidence EvidenceWith(const RotorLibrary* library,
                             const std::vector<Candidate>& candidates) const;

  const FlightLog& log_;
  RotorCalibrationOptions options_;  // noise and delay as learned
  RotorNoise stated_;
  std::vector<Effect> effects_;
  std::vector<RotorFound> found_;
  std::unique_ptr<RotorWorld> world_;
  RotorBatchResult batch_;
  std::optional<RotorNormal> normal_;
  bool started_ = false;
};

// The parameter size that one unit of a found cause's column in RotorSearch::normal represents.
Eigen::VectorXd ColumnUnits(const EffectInfo& info);

}  // namespace trueline
