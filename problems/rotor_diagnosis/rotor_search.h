// The search for causes on one rotor-driven flight: base fit, tests of all candidates, refits with
// those found.
#pragma once

#include <memory>
#include <optional>

#include "problems/diagnosis/diagnosis.h"
#include "problems/rotor_diagnosis/rotor_columns.h"

namespace trueline {

inline constexpr double kRotorCluster = 1.0;  // s, over which residuals may hang together

// A cause under refinement.
struct RotorFound {
  Candidate candidate;
  Eigen::VectorXd value;
};

struct RotorTested {
  Candidate candidate;
  Eigen::VectorXd value;  // estimate by one step from where the fit stands
  ScoreTest test;         // in units of each parameter's step
  double gain = 0.0;      // twice the increase of the log likelihood
  double p = 1.0;         // corrected for the candidates of the same id

  // Gain less what as many parameters of no meaning would give (Akaike).
  double Merit() const { return gain - 2.0 * static_cast<double>(value.size()); }
};

inline const Eigen::VectorXd& ValueOf(const RotorTested& t) { return t.value; }

// A term of the library: what the residual goes with.
struct RotorDescribed {
  std::string name;
  double p;      // after the correction for the number of terms
  double merit;  // as RotorTested::Merit
  bool of_sensor;

  // Explains clearly more than what has `merit`.
  bool Stands(double alpha, double than) const {
    constexpr double kClearlyBetter = 10.0;
    return p < alpha && merit > than + kClearlyBetter;
  }
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
  // All candidates on top of the last Fit, and the library, for described(). Where a sensor's
  // readings explain clearly more than any effect, effects are judged beside them.
  std::vector<RotorTested> TestAll(const std::vector<Candidate>& candidates);
  // The candidates alone.
  std::vector<RotorTested> Test(const std::vector<Candidate>& candidates) {
    return TestWith(nullptr, candidates);
  }
  const std::vector<RotorDescribed>& described() const { return described_; }
  // One cause of the last Fit against the model without it, the others kept; sizes in its units.
  ScoreTest TestFound(const std::vector<RotorFound>& found, std::size_t which) const;

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
  std::vector<RotorTested> TestWith(const RotorLibrary* library,
                                    const std::vector<Candidate>& candidates);

  const FlightLog& log_;
  RotorCalibrationOptions options_;  // noise and delay as learned
  RotorNoise stated_;
  std::vector<Effect> effects_;
  std::vector<RotorFound> found_;
  std::unique_ptr<RotorWorld> world_;
  RotorBatchResult batch_;
  std::optional<RotorNormal> normal_;
  std::vector<RotorDescribed> described_;
  bool started_ = false;
};

// Parameter sizes at which one step of a column ends up: `steps` in units of its step.
Eigen::VectorXd SizesFromSteps(const EffectInfo& info, const Eigen::VectorXd& steps);
// The sizes that one unit of a found cause's columns in RotorSearch::normal stands for.
Eigen::VectorXd ColumnUnits(const EffectInfo& info);

}  // namespace trueline
