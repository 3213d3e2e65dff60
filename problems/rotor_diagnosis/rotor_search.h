// The search for causes on one rotor-driven flight: base fit, tests of all candidates, refits with
// those found.
#pragma once

#include <memory>
#include <optional>

#include "problems/diagnosis/diagnosis.h"
#include "problems/rotor_diagnosis/rotor_evidence.h"

namespace trueline {

inline constexpr double kRotorCluster = 1.0;  // s, over which residuals may hang together

// A cause under refinement.
struct RotorFound {
  Candidate candidate;
  Eigen::VectorXd value;
};

class RotorSearch {
 public:
  // Learns noise and delay of the rotor speeds as a calibration does. `log` must outlive this.
  RotorSearch(const FlightLog& log, const RotorCalibrationOptions& options);
  // Starts with what another search has learned.
  RotorSearch(const RotorSearch& other, const FlightLog& log)
      : log_(log), options_(other.options_), stated_(other.stated_) {}

  // Solves with the causes in the model; their values are refined, then the noise.
  void Fit(std::vector<RotorFound>* found);
  // Solves with the causes at their values.
  void Refit(const std::vector<RotorFound>& found);
  // All candidates on top of the last Fit, and the library's terms.
  RotorEvidence TestAll(const std::vector<Candidate>& candidates) const;
  // The candidates alone.
  std::vector<RotorTested> Test(const std::vector<Candidate>& candidates) const;
  // One cause of the last Fit against the model without it, the others kept; sizes in its units.
  ScoreTest TestFound(const std::vector<RotorFound>& found, std::size_t which) const {
    return TestFoundBeside(found, which, *normal_, {});
  }
  // The same beside columns (from 0) of `normal`, which holds those of the causes first.
  ScoreTest TestFoundBeside(const std::vector<RotorFound>& found, std::size_t which,
                            const RotorNormal& normal, std::vector<int> beside) const;

  const RotorCalibrationOptions& options() const { return options_; }
  const RotorNoise& noise() const { return options_.noise; }
  const RotorWorld& world() const { return *world_; }
  const RotorBatchResult& batch() const { return batch_; }
  RotorBatchOptions BatchOptions() const;
  // The last fit with the columns of what is found.
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

// The sizes that one unit of a found cause's columns in RotorSearch::normal stands for.
Eigen::VectorXd ColumnUnits(const EffectInfo& info);

}  // namespace trueline
