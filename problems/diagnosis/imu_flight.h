// A flight under diagnosis with the model that the IMU drives (Li et al. 2019, eq. 15).
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "problems/diagnosis/agreement.h"
#include "problems/diagnosis/diagnosed_flight.h"
#include "problems/diagnosis/false_gate.h"
#include "problems/diagnosis/imu_columns.h"
#include "problems/diagnosis/prepare_log.h"

namespace trueline {

// Searches causes on the first flight, see diagnosis.h. A flight that contradicts the model's
// constants (--model) is fitted without them; of the first flight a warning says so.
Diagnosis Diagnose(const std::vector<FlightLog>& logs, const ImuDiagnosisOptions& options);

// Whether a wind is looked for: not indoors, and not without the accelerometer's x and y, because
// it cannot be distinguished from a tilt of E' then.
bool LooksForWind(const FlightLog& log, const VgdOptions& options);

// A model fitted to a part of a flight.
struct PartFit {
  ThetaVector value, sigma;  // physical parameters
  std::vector<Effect> effects;
};

class ImuDrivenFlight final : public DiagnosedFlight {
  // A model as it was fitted.
  struct FittedModel {
    std::vector<Found> found;
    BaseFit fit;
    std::vector<VelocitySample> path;
  };

 public:
  // `bare`: the fit of this log without causes, where it is known.
  explicit ImuDrivenFlight(std::shared_ptr<const PreparedLog> log,
                           std::optional<FittedModel> bare = std::nullopt);

  DriveKind drive() const override { return DriveKind::kImu; }
  const FlightLog& log() const override { return log_->recorded; }
  const FlightLog& data() const override { return log_->data; }
  std::vector<VelocitySample> Path() const override { return path_; }
  CatalogueScope Scope() const override;
  void Fit(std::vector<Found>* found) override;
  std::unique_ptr<Linearisation> Linearise(const std::vector<Candidate>& candidates,
                                           bool terms) const override;
  bool CanModel(const TermForm&) const override { return true; }
  std::vector<TermMotion> Motions() const override;
  std::unique_ptr<Linearisation> LineariseTerms(const std::vector<TermForm>& terms) const override;
  std::vector<std::string> Constants() const override;
  bool ConstantsArePhysical(const Found& found) const override;
  std::vector<std::string> ExtraordinaryNoise() const override;
  std::vector<Effect> KnownEffects() const override { return log_->options.effects; }
  // Of the last Fit, as a calibration states them.
  std::vector<ParameterEstimate> Estimates() const;
  std::unique_ptr<DiagnosedFlight> WithoutCauses() const override;
  HeldOutErrors ErrorsHeldOut(const std::vector<Found>& found, bool with_false_data) const override;
  std::optional<Cause> FindFalseData(double alpha) const override;
  std::unique_ptr<DiagnosedFlight> WithoutFalseData(double alpha) const override;
  std::optional<CandidateReport> ReportFalseData(const std::optional<Cause>& found,
                                                 double alpha) const override;
  Residuals WhitenedResiduals() const override;
  std::vector<ReplayError> ReplayOpenLoop() const override;
  std::string ReplaysAgainst() const override;
  ReplaySituation SituationOf(const ReplayError& replay) const override;
  void Describe(Diagnosis* diagnosis) const override;

 private:
  // Ordinary errors that are nuisances: one that is found is fitted once, without a prior.
  std::vector<Candidate> Ordinary() const;
  int OrdinaryCount() const;  // their columns, which come first
  // True if this model is one of those that are kept.
  bool Restore(const std::vector<Found>& found);
  void Start();  // of a fit, once the flight is rebuilt
  void Rebuild(const std::vector<Found>& found);
  void SettleNoise(int sweeps, int repeats);
  void StorePath();
  Columns ColumnsInModel(const std::vector<Found>& found, const Columns& ordinary);
  Columns OrdinaryColumns();
  const Eigen::MatrixXd& ColumnsOf(const Candidate& candidate, const Eigen::VectorXd& here) const;
  const BaseFit& FitAsStated() const;
  std::optional<FalseGate> FindFalsePlace(double alpha) const;
  // Physical parameters with their sigmas.
  ThetaVector Parameters() const;
  ThetaVector Sigmas() const;
  // The model of the last Fit refitted to the other half.
  PartFit FitWithout(int half, const std::vector<Found>& found) const;
  void AddArcs(const FlightLog& corrected, const PartFit& fit, int half,
               std::map<int, double>* errors) const;
  void AddAgreement(const PartFit& fit, int half, HeldOutErrors* errors) const;
  HeldOutErrors ErrorsOfHalf(const FlightLog& log, const PartFit& fit, int half) const;

  std::shared_ptr<const PreparedLog> log_;
  VgdOptions options_;  // with wide priors of drag
  FlightData data_;
  FlightPlan plan_;
  std::vector<Effect> effects_;  // found
  std::vector<Effect> all_;      // those of --model, then the found ones
  std::vector<VelocitySample> path_;
  FlightLog corrected_;
  std::shared_ptr<BaseFlight> flight_;
  BaseFit fit_;
  std::vector<FittedModel> kept_;                 // the bare one, then the last ones with causes
  std::unique_ptr<const MocapComparison> mocap_;  // none without mocap
  ProcessNoise bare_process_;                     // learned by the first fit, which has no causes
  // Of candidates at their neutral value, for the last Fit.
  mutable std::map<std::pair<std::string, std::map<std::string, double>>, Eigen::MatrixXd> columns_;
  mutable std::optional<BaseFit> as_stated_;  // of FitAsStated
};

}  // namespace trueline
