#include "problems/diagnosis/imu_flight.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/calibration/conflict.h"
#include "problems/diagnosis/imu_columns.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/prepare_log.h"
#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

// Errors that every vehicle has to some extent are nuisances, with their ordinary sizes as priors:
// the attitude filter mistakes some acceleration for gravity and its integral winds up in turns;
// the thrust axis measures a share of the other two, which grows with drag (beside the misalignment
// of the axes, which eq. 15 leaves out of a_z).
const std::vector<Candidate>& OrdinaryErrors() {
  static const std::vector<Candidate> errors = {{&InfoOf("ahrs_acceleration_error"), {}},
                                                {&InfoOf("body_tilt_drift"), {}},
                                                {&InfoOf("accel_cross_axis"), {}}};
  return errors;
}

// The attitude filter's errors that the flight itself models: those that no column above and no
// named effect states.
AttitudeErrorPriors FilterErrorsBeside(const std::vector<Effect>& effects,
                                       AttitudeErrorPriors priors) {
  priors.gain = 0.0;  // ahrs_acceleration_error
  for (const Effect& effect : effects) {
    const auto replaces = InfoOf(effect).replaces;
    if (replaces != nullptr) priors.*replaces = 0.0;
  }
  return priors;
}

// The last step of the found effects, and the move that was made for it.
struct LastStep {
  Eigen::VectorXd step, move;
};

// Moves the found effects by `step`, clamped to plausible values. True once the move is small
// against the steps of the difference quotients. The first steps are those of Newton's method, of
// which the first never converges. Later ones shrink, or turn back, by a constant ratio: the noise
// is learned again each time, and the flight's path follows the effect. Aitken's extrapolation goes
// where they would end.
bool Advance(const Eigen::VectorXd& step, bool extrapolate, LastStep* last,
             std::vector<Found>* found) {
  constexpr double kNearest = 0.5, kFurthest = 4.0;  // times the step
  bool settled = last->step.size() > 0 || step.size() == 0;
  Eigen::VectorXd moves = step;
  int at = 0;
  for (Found& f : *found) {
    for (int k = 0; k < f.value.size(); ++k, ++at) {
      const EffectParameterInfo& info = f.candidate.info->parameters[k];
      const bool moved = extrapolate && last->move[at] != 0.0;  // not held by a bound
      const double ratio = moved ? 1.0 + (step[at] - last->step[at]) / last->move[at] : 0.0;
      const double ahead = ratio < 1.0 ? std::clamp(1.0 / (1.0 - ratio), kNearest, kFurthest) : 1.0;
      const double before = f.value[k];
      f.value[k] = std::clamp(before + ahead * step[at], -info.plausible, info.plausible);
      moves[at] = f.value[k] - before;
      settled = settled && std::abs(moves[at]) < 0.2 * info.step;
    }
  }
  *last = {step, moves};
  return settled;
}

// Gates of the fixes that are fitted. The log may hold others, in passes that are left out.
std::set<int> GatesSeen(const FlightLog& log, const FlightPlan& plan) {
  std::set<int> gates;
  for (const std::size_t i : plan.fixes) {
    if (log.fixes[i].gate >= 0) gates.insert(log.fixes[i].gate);
  }
  return gates;
}

bool AppliesTo(const FlightLog& log, bool gates, const VgdOptions& options,
               const EffectInfo& info) {
  const bool accelerometer = options.drive.thrust != ThrustSource::kLevelFlight;
  if (info.id == "false_gate") return false;  // not a linear effect; see FindFalseData
  if (info.enters == EntersAt::kAttitude && log.attitude.empty()) return false;
  if (info.enters == EntersAt::kAccelerometer && !accelerometer) return false;
  if (info.id == "wind" && !LooksForWind(log, options)) return false;
  const bool needs_map = info.id == "fix_scale" || info.id == "camera_misalignment";
  if (needs_map && log.gates.empty()) return false;
  return info.enters != EntersAt::kFix || gates;
}

// Columns of the flight's rows, of which the force samples read what comes a moment later.
Eigen::MatrixXd ReadEarlier(const BaseFlight& flight, Eigen::MatrixXd columns) {
  constexpr Eigen::Index kEarlier = 2;  // samples, a quarter of a second: a controller's answer
  const auto size = 2 * std::ssize(flight.plan().forces), by = std::min(2 * kEarlier, size);
  auto forces = columns.middleRows(flight.measurement_rows() - size, size);
  forces.topRows(size - by) = forces.bottomRows(size - by).eval();
  forces.bottomRows(by).setZero();
  columns.topRows(flight.measurement_rows() - size).setZero();
  columns.bottomRows(flight.rows() - flight.measurement_rows()).setZero();
  return columns;
}

// Fits a flight without the model's constants if it contradicts them, and says why.
std::unique_ptr<ImuDrivenFlight> FitWithoutCauses(const FlightLog& log,
                                                  const ImuDiagnosisOptions& options,
                                                  std::vector<std::string>* warnings) {
  auto flight = std::make_unique<ImuDrivenFlight>(PrepareLog(log, options));
  if (!options.priors_without_model) return flight;
  const MotionPriors model = OpenPriors(options.vgd).priors;
  if (ContradictionsAmong(CompareWithModel(model, model, {flight->Estimates()})).empty()) {
    return flight;
  }
  ImuDiagnosisOptions open = options;
  open.vgd.priors = *options.priors_without_model;
  flight = std::make_unique<ImuDrivenFlight>(PrepareLog(log, open));
  *warnings = WhyModelIsNotUsed(
      CompareWithModel(model, OpenPriors(open.vgd).priors, {flight->Estimates()}));
  return flight;
}

}  // namespace

Diagnosis Diagnose(const std::vector<FlightLog>& logs, const ImuDiagnosisOptions& options) {
  std::vector<std::string> warnings = options.warnings;
  const MakeFlight make = [&](const FlightLog& log) {
    std::vector<std::string> conflicts;
    auto flight = FitWithoutCauses(log, options, &conflicts);
    if (&log == &logs.front()) warnings.insert(warnings.end(), conflicts.begin(), conflicts.end());
    return flight;
  };
  Diagnosis diagnosis = Diagnose(logs, make, options);
  diagnosis.warnings.insert(diagnosis.warnings.end(), warnings.begin(), warnings.end());
  return diagnosis;
}

bool LooksForWind(const FlightLog& log, const VgdOptions& options) {
  return log.environment != "indoors" && options.drag_measurement.enabled;
}

ImuDrivenFlight::ImuDrivenFlight(std::shared_ptr<const PreparedLog> log,
                                 std::optional<FittedModel> bare)
    : log_(std::move(log)),
      options_(OpenPriors(log_->options.vgd)),
      data_(log_->data, options_.drive, options_.passes, options_.drag_measurement),
      plan_(FlightPlan::For(data_, options_)) {
  if (!log_->data.mocap.empty()) mocap_ = std::make_unique<MocapComparison>(log_->data);
  if (bare) kept_.push_back(std::move(*bare));
  std::vector<Found> none;
  Fit(&none);
  bare_process_ = fit_.noise.process;
}

CatalogueScope ImuDrivenFlight::Scope() const {
  const FlightLog& data = log_->data;
  CatalogueScope scope;
  scope.gates = GatesSeen(data, plan_);
  scope.applies = [this, gates = !scope.gates.empty()](const EffectInfo& info) {
    return AppliesTo(log_->data, gates, options_, info);
  };
  scope.duration = SecondsBetween(data.imu.front().t, data.imu.back().t);
  return scope;
}

std::unique_ptr<DiagnosedFlight> ImuDrivenFlight::WithoutCauses() const {
  return std::make_unique<ImuDrivenFlight>(log_, kept_.front());
}

ThetaVector ImuDrivenFlight::Parameters() const {
  const ParameterScaling scaling(options_);
  return scaling.mean + scaling.sigma.cwiseProduct(fit_.x.theta);
}

ThetaVector ImuDrivenFlight::Sigmas() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::MatrixXd cov = system.reduced().Covariance();
  return ParameterScaling(options_).sigma.cwiseProduct(
      cov.diagonal().head<kThetaSize>().cwiseSqrt());
}

std::vector<Candidate> ImuDrivenFlight::Ordinary() const {
  if (log_->data.attitude.empty()) return {};
  std::vector<Candidate> errors = OrdinaryErrors();
  std::erase_if(errors, [this](const Candidate& error) {
    return std::ranges::count(effects_, error.id(), &Effect::id) > 0;
  });
  return errors;
}

int ImuDrivenFlight::OrdinaryCount() const {
  int count = 0;
  for (const Candidate& error : Ordinary()) count += error.size();
  return count;
}

void ImuDrivenFlight::StorePath() {
  path_.clear();
  for (std::size_t s = 0; s < plan_.segments.size(); ++s) {
    path_.push_back({plan_.segments[s].begin, fit_.x.nodes[s].segment<3>(kStateAt + 3),
                     fit_.x.nodes[s].segment<3>(kStateAt)});
  }
}

void ImuDrivenFlight::Rebuild(const std::vector<Found>& found) {
  effects_ = EffectsOf(found);
  all_ = Concatenated(log_->options.effects, effects_);
  corrected_ = CorrectLog(log_->data, all_, path_);
  options_.drive.attitude_errors =
      FilterErrorsBeside(all_, log_->options.vgd.drive.attitude_errors);
  flight_ = std::make_shared<BaseFlight>(corrected_, plan_, options_, ForceEffectsOf(all_));
}

bool ImuDrivenFlight::Restore(const std::vector<Found>& found) {
  const auto kept = std::ranges::find(kept_, found, &FittedModel::found);
  if (kept == kept_.end()) return false;
  fit_ = kept->fit;
  path_ = kept->path;
  Rebuild(found);
  return true;
}

// The robust weights depend on the strengths, and the strengths on the weights: both are repeated
// until the fixes' strength stays, or `repeats` times.
void ImuDrivenFlight::SettleNoise(int sweeps, int repeats) {
  constexpr double kStays = 0.03;  // relative
  for (int i = 0; i < repeats; ++i) {
    const double before = fit_.noise.fix_scale;
    LearnNoise(fit_.Linear(*flight_), OrdinaryCount(), sweeps, &fit_.noise);
    Solve(flight_.get(), 3, &fit_);
    if (std::abs(std::log(fit_.noise.fix_scale / before)) < kStays) break;
  }
}

void ImuDrivenFlight::Fit(std::vector<Found>* found) {
  columns_.clear();
  as_stated_.reset();
  if (Restore(*found)) return;
  LastStep last;
  Columns ordinary;
  for (int i = 0; i <= kMostIterations; ++i) {
    Rebuild(*found);
    if (i == 0) Start();
    if (i < 2) ordinary = OrdinaryColumns();  // later they change little
    fit_.columns = ColumnsInModel(*found, ordinary);
    Solve(flight_.get(), 5, &fit_);
    // Each refit learns the noise again, so that one repeat of it is enough.
    SettleNoise(i == 0 ? 6 : 2, i == 0 ? 4 : 1);
    StorePath();
    const Eigen::VectorXd step = fit_.columns.value.tail(fit_.columns.count() - OrdinaryCount());
    if (Advance(step, i > 2, &last, found)) break;
  }
  kept_.push_back({*found, fit_, path_});
  if (kept_.size() > 1 + kMostKept) kept_.erase(kept_.begin() + 1);
}

void ImuDrivenFlight::Start() {
  if (!kept_.empty()) {
    // The constants of the last model may be far from those of this one.
    fit_.x.theta.setZero();
    return;
  }
  fit_.x = flight_->RoughStart(data_.passes);
  fit_.noise = StartingNoise(options_);
  fit_.columns = Columns::None(flight_->rows());
  Solve(flight_.get(), kMostIterations, &fit_);
  StorePath();
}

// With their usual sizes as priors.
Columns ImuDrivenFlight::OrdinaryColumns() {
  Columns all = Columns::None(flight_->rows());
  const Eigen::VectorXd here = flight_->Evaluate(fit_.x, false).r;
  const SensitivityBase base{log_->data, plan_, options_, all_, path_};
  for (const Candidate& error : Ordinary()) {
    Columns columns =
        FreeColumns(Sensitivity(base, error, error.Neutral(), fit_.x, here, flight_.get()));
    columns.precision = error.Ordinary().cwiseAbs2().cwiseInverse();
    all = all.With(columns);
  }
  return all;
}

// Ordinary errors, then the found effects at their values.
Columns ImuDrivenFlight::ColumnsInModel(const std::vector<Found>& found, const Columns& ordinary) {
  const Eigen::VectorXd here = flight_->Evaluate(fit_.x, false).r;
  Columns columns = ordinary;
  for (std::size_t k = 0; k < found.size(); ++k) {
    std::vector<Effect> others = all_;
    others.erase(others.end() - static_cast<long>(found.size() - k));
    const SensitivityBase without{log_->data, plan_, options_, others, path_};
    columns = columns.With(FreeColumns(
        Sensitivity(without, found[k].candidate, found[k].value, fit_.x, here, flight_.get())));
  }
  return columns;
}

// Those that are not known yet need the flight evaluated at the fit.
const Eigen::MatrixXd& ImuDrivenFlight::ColumnsOf(const Candidate& candidate,
                                                  const Eigen::VectorXd& here) const {
  const auto [known, added] = columns_.try_emplace({candidate.id(), candidate.fixed});
  if (added) {
    const SensitivityBase base{log_->data, plan_, options_, all_, path_};
    known->second = Sensitivity(base, candidate, candidate.Neutral(), fit_.x, here, flight_.get());
  }
  return known->second;
}

std::unique_ptr<Linearisation> ImuDrivenFlight::Linearise(const std::vector<Candidate>& candidates,
                                                          bool terms) const {
  ColumnPlaces places;
  places.nuisances = places.Next(kThetaSize + OrdinaryCount());
  for (const Candidate& error : Ordinary()) places.ordinary.push_back(error.id());
  const auto effect = [&](const EffectInfo& info) {
    const std::size_t size = info.parameters.size();
    return EffectColumns{places.Next(size), Eigen::VectorXd::Ones(size)};
  };
  std::vector<const Eigen::MatrixXd*> parts;
  Eigen::MatrixXd of_terms;
  for (const Effect& e : effects_) places.found.push_back(effect(InfoOf(e)));
  const Eigen::VectorXd here =
      candidates.empty() ? Eigen::VectorXd() : flight_->Evaluate(fit_.x, false).r;
  for (const Candidate& c : candidates) {
    places.candidates.push_back(effect(*c.info));
    parts.push_back(&ColumnsOf(c, here));
  }
  if (terms) {
    // By segments: within one, thrust and rates go with vibration.
    const ImuOpenTerms open(flight_.get(), fit_.x, 1);
    const TermScope scope{drive(), log_->data, open.Motions()};
    const std::vector<TermGroup> groups = TermGroups(scope);
    for (const TermGroup& group : groups) {
      places.terms.push_back(TermColumnsOf(group, scope.motions, places.Next(group.terms.size())));
    }
    of_terms = open.Columns(TermsOf(groups));
    parts.push_back(&of_terms);
  }
  // A force acts on the path, too, and its columns change slowly: the sum of both is its size.
  std::vector<Eigen::MatrixXd> earlier;
  earlier.reserve(effects_.size());
  for (std::size_t k = 0; k < effects_.size(); ++k) {
    if (InfoOf(effects_[k]).enters != EntersAt::kAccelerometer) continue;
    const std::vector<int>& own = places.found[k].columns;
    earlier.push_back(ReadEarlier(
        *flight_, fit_.columns.d_rows.middleCols(own.front() - kThetaSize, std::ssize(own))));
    parts.push_back(&earlier.back());
    places.found[k].answers = places.Next(own.size());
  }
  Eigen::MatrixXd stacked(flight_->rows(), places.placed - kThetaSize - fit_.columns.count());
  Eigen::Index column = 0;
  for (const Eigen::MatrixXd* part : parts) {
    stacked.middleCols(column, part->cols()) = *part;
    column += part->cols();
  }
  return std::make_unique<ImuLinearisation>(flight_, fit_, OrdinaryCount(),
                                            fit_.columns.With(FreeColumns(stacked)), fit_.noise,
                                            std::move(places));
}

std::vector<TermMotion> ImuDrivenFlight::Motions() const {
  return ImuOpenTerms(flight_.get(), fit_.x).Motions();
}

std::unique_ptr<Linearisation> ImuDrivenFlight::LineariseTerms(
    const std::vector<TermForm>& terms) const {
  const Eigen::MatrixXd columns = ImuOpenTerms(flight_.get(), fit_.x).Columns(terms);
  ColumnPlaces places;
  places.nuisances = places.Next(kThetaSize + fit_.columns.count());  // causes in the model, too
  for (const TermForm& term : terms) places.terms.push_back({term.Name(), places.Next(1), {}});
  return std::make_unique<ImuLinearisation>(flight_, fit_, OrdinaryCount(),
                                            fit_.columns.With(FreeColumns(columns)), fit_.noise,
                                            std::move(places));
}

std::vector<std::string> ImuDrivenFlight::Constants() const {
  std::vector<std::string> names;
  for (const ParameterInfo& info : kTheta) names.emplace_back(info.name);
  return names;
}

// A force effect that is fitted together with a drag that accelerates the vehicle (K_x or K_y
// positive by 3 sigmas) is strongly correlated with it, and neither value is physical.
bool ImuDrivenFlight::ConstantsArePhysical(const Found& found) const {
  if (found.candidate.info->enters != EntersAt::kForce) return true;
  const ThetaVector value = Parameters(), sigma = Sigmas();
  return std::ranges::all_of(std::array{InTheta("K_x"), InTheta("K_y")},
                             [&](int i) { return value[i] <= kApartSigmas * sigma[i]; });
}

std::vector<std::string> ImuDrivenFlight::ExtraordinaryNoise() const {
  const ProcessNoise& process = fit_.noise.process;
  // A compass error drifts slowly; a heading error that changes within seconds follows the turns.
  const double most_heading = process.memory < 10.0 ? 2.5 : 6.0;  // deg
  return Extraordinary({
      {process.gust, 0.35, "unmodelled forces of {:.2f} m/s^2 that are correlated in time"},
      {process.acceleration, 0.25, "unmodelled white accelerations of {:.2f} m/s^2/sqrt(Hz)"},
      {process.tilt / kDegree, 2.0, "a tilt of the attitude that drifts by {:.1f} deg"},
      {process.heading / kDegree, most_heading, "a heading that drifts by {:.1f} deg"},
      {fit_.noise.fix_scale, 2.0, "fixes that scatter {:.1f} times as much as the detector states"},
  });
}

}  // namespace trueline
