// A flight under diagnosis with the model that rotor speeds drive (Boehm et al. 2020).
//
// The base fit is the batch calibration of the whole flight: constants, states at all poses, noise
// of the greatest likelihood. The forces (specific force, angular acceleration) that an effect
// would add along the fitted flight become a column of the linearised fit.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>

#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/rotor_columns.h"

namespace trueline {

struct RotorDiagnosisOptions : SearchOptions {
  RotorCalibrationOptions calibration;

  explicit RotorDiagnosisOptions(RotorCalibrationOptions options)
      : calibration(std::move(options)) {}
};

// Searches causes on the first flight, see diagnosis.h. A flight that contradicts the model's
// constants (--model) is fitted without them, or without the model's effects, as a calibration
// does; of the first flight a warning says so.
Diagnosis Diagnose(const std::vector<FlightLog>& logs, const RotorDiagnosisOptions& options);

class RotorDrivenFlight final : public DiagnosedFlight {
 public:
  // Learns noise and delay of the rotor speeds as a calibration does. `log` must outlive this
  // object.
  RotorDrivenFlight(const FlightLog& log, const RotorCalibrationOptions& options);

  DriveKind drive() const override { return DriveKind::kRotors; }
  const FlightLog& log() const override { return log_; }
  CatalogueScope Scope() const override;
  void Fit(std::vector<Found>* found) override;
  std::unique_ptr<Linearisation> Linearise(const std::vector<Candidate>& candidates,
                                           bool terms) const override;
  bool CanModel(const TermForm& term) const override {
    return term.on == TermOn::kForce || term.on == TermOn::kTurn;
  }
  std::vector<TermMotion> Motions() const override;
  std::unique_ptr<Linearisation> LineariseTerms(const std::vector<TermForm>& terms) const override;
  std::vector<std::string> Constants() const override;
  std::vector<std::string> ExtraordinaryNoise() const override;
  std::vector<Effect> KnownEffects() const override;
  std::unique_ptr<DiagnosedFlight> WithoutCauses() const override;
  std::unique_ptr<DiagnosedFlight> Reference() const override;
  HeldOutErrors ErrorsHeldOut(const std::vector<Found>& found, bool with_false_data) const override;
  Residuals WhitenedResiduals() const override;
  std::vector<ReplayError> ReplayOpenLoop() const override;
  std::string ReplaysAgainst() const override;
  ReplaySituation SituationOf(const ReplayError& replay) const override;
  void Describe(Diagnosis* diagnosis) const override;

 private:
  // The model and the solution that weights are evaluated by.
  struct Weights {
    std::shared_ptr<const RotorSetup> setup;
    RotorBatchResult at;
    RotorWeights By() const { return {setup->model, *setup->data, at}; }
  };
  // The flight fitted with causes: the model with them, and the solution with its noise and
  // weights.
  struct Fitted {
    std::vector<Found> found;
    RotorNoise noise;
    std::shared_ptr<const RotorSetup> setup;
    RotorBatchResult batch;
    Weights weights;
  };

  // The same flight fitted without causes.
  RotorDrivenFlight(const RotorDrivenFlight& other, bool learn_noise);

  void Restore(const Fitted& fit);

  // Solves with the causes held at their values, from `start` and by `weights`, as RunRotorBatch.
  // `rough`: as exactly as a refinement's steps need it.
  void Solve(const std::vector<Found>& found, const RotorBatchResult* start,
             const RotorWeights* weights, bool rough = false);
  // The same from the prior, weights evaluated at its solution. Throws InputError if the model runs
  // away from the flight.
  void SolveFromPrior(const std::vector<Found>& found);
  // The same from the last solution, with weights evaluated there. False if the model runs away
  // from the flight, there or at the new solution: solution and weights are then those before.
  bool Reweigh(const std::vector<Found>& found);
  // Reweighs. Where the model runs away, the values are moved halfway towards those of `regular`,
  // from whose solution they are then solved, until it does not.
  void ReweighOrShorten(const Fitted& regular, std::vector<Found>* found);
  // Solves at the values `found`, or nearer to `before`, where the flight is fitted, so that the
  // cost with the weights of `fit_` does not rise. False if it rises nearby too; the flight is
  // then fitted at `before`.
  bool Move(const std::vector<Found>& before, std::vector<Found>* found);
  // `found` with the values of the last fit, without effect where new. `comparable`: false if that
  // fit had another cause or other noise, so that costs can't be compared.
  std::vector<Found> AtLastFit(const std::vector<Found>& found, bool* comparable) const;
  // Moves the values to the best fit in at most so many steps. After a single one, which is rough,
  // the weights stay those of before.
  void RefineValues(std::vector<Found>* found, int most_steps);
  // One Gauss-Newton step of the causes with the weights of `fit_`. True if it is small in
  // sigmas.
  bool Step(std::vector<Found>* found) const;
  void LearnNoiseAgain();
  RotorBatchOptions BatchOptions() const;
  // Normal equations of the last Solve with columns of these variants, then those of `beside`.
  RotorNormal NormalWith(std::vector<RotorVariant> variants, const RotorColumns* beside = nullptr,
                         const RotorWeights* weights = nullptr) const;
  // The same with the columns of its causes; computed at the first use.
  const RotorNormal& Normal() const;
  int constants() const { return static_cast<int>(fit_.setup->prior.Free().size()); }
  std::vector<RotorVariant> VariantsFor(const Candidate& candidate, const Eigen::VectorXd& value,
                                        const std::vector<Effect>& others) const;
  // Variants of all causes in the model, each given the others.
  std::vector<RotorVariant> VariantsOfFound() const;
  // The model of the last Fit refitted to the other half.
  struct PartFit {
    RotorConstants constants;
    std::vector<Effect> effects;
  };
  PartFit FitWithout(int half, const std::vector<Found>& found) const;

  const FlightLog& log_;
  RotorCalibrationOptions options_;                         // noise and delay as learned
  RotorNoise stated_;                                       // before learning
  bool learn_noise_;                                        // again, with causes in the model
  std::map<std::vector<std::string>, RotorNoise> learned_;  // by the names of causes and terms
  std::shared_ptr<const LaggedRotorData> lagged_;
  Fitted fit_;
  std::shared_ptr<const Fitted> bare_;  // without causes
  std::deque<Fitted> kept_;             // the last fits with causes
  mutable std::optional<RotorNormal> normal_;
};

}  // namespace trueline
