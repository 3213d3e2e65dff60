#include "problems/diagnosis/rotor_flight.h"

#include <algorithm>
#include <cmath>

#include "problems/calibration/learn_rotor_noise.h"
#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

constexpr double kLearnOn = 10.0;  // s of flight that noise is learned on
constexpr int kMostSteps = 4;      // of a refinement
// Of the cost:
constexpr double kSameCost = 0.05;  // a smaller change is the solver's tolerance
// Iterations of a solve meanwhile. Where a step was too long, the solve crawls: the cost stays
// high.
constexpr int kRoughIterations = 12;

// Lowest height of the flight above the floor (p_z = 0), m.
double LowestHeight(const RotorData& data) {
  double lowest = -data.poses.front().p_E.z();
  for (const RotorPose& pose : data.poses) lowest = std::min(lowest, -pose.p_E.z());
  return lowest;
}

// Effects are left out that the base fit estimates as constants, the motors' lag where it computes
// speeds from commands, the ground effect where the flight is not above p_z = 0.
bool AppliesTo(const RotorSetup& setup, const EffectInfo& info) {
  constexpr double kOnTheFloor = 0.02;  // m
  for (const EffectParameterInfo& parameter : info.parameters) {
    if (setup.prior.Estimates(parameter.constant)) return false;
  }
  if (info.id == "motor_lag") return !setup.data->motors;
  return info.id != "ground_effect" || LowestHeight(*setup.data) > kOnTheFloor;
}

// `found` with values halfway to those of `to`, which has the same causes.
std::vector<Found> Halfway(std::vector<Found> found, const std::vector<Found>& to) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    found[i].value = 0.5 * (found[i].value + to[i].value);
  }
  return found;
}

std::vector<Found> WithoutEffect(std::vector<Found> found) {
  for (Found& f : found) f.value = f.candidate.Neutral();
  return found;
}

// The options without what of the model (--model) the whole flight contradicts.
RotorCalibrationOptions OptionsFor(const FlightLog& log, const RotorCalibrationOptions& options) {
  if (!options.prior_without_model) return options;
  RotorCalibrationOptions whole = options, used = options;
  whole.hold_out = 0.0;
  CalibrateRotors(log, whole, &used);
  return used;
}

}  // namespace

Diagnosis Diagnose(const std::vector<FlightLog>& logs, const RotorDiagnosisOptions& options) {
  const MakeFlight make = [&](const FlightLog& log) {
    return std::make_unique<RotorDrivenFlight>(log, OptionsFor(log, options.calibration));
  };
  return Diagnose(logs, make, options);
}

RotorDrivenFlight::RotorDrivenFlight(const FlightLog& log, const RotorCalibrationOptions& options)
    : log_(log), options_(options), stated_(options.noise), learn_noise_(options.learn_noise) {
  RotorEkfOptions filter{options.noise, options.prior, options.wander};
  // Weights that change with the constants make the search for causes take twice as long.
  options_.data.weigh_speed_noise = false;
  LearnFromFlight(
      ModelFor(options, log), log,
      {options.learn_noise, options.learn_rotor_delay, options.learn_gyro_delay, kLearnOn, stated_},
      &options_.data, &filter);
  options_.noise = filter.noise;
  lagged_ = std::make_shared<const LaggedRotorData>(log, options.vehicle.model.num_rotors(),
                                                    options_.data);
  SolveFromPrior({});
  bare_ = std::make_shared<const Fitted>(fit_);
}

RotorDrivenFlight::RotorDrivenFlight(const RotorDrivenFlight& other, bool learn_noise)
    : log_(other.log_),
      options_(other.options_),
      stated_(other.stated_),
      learn_noise_(learn_noise),
      learned_(other.learned_),
      lagged_(other.lagged_),
      bare_(other.bare_) {
  Restore(*bare_);
}

std::unique_ptr<DiagnosedFlight> RotorDrivenFlight::WithoutCauses() const {
  return std::unique_ptr<DiagnosedFlight>(new RotorDrivenFlight(*this, options_.learn_noise));
}

std::unique_ptr<DiagnosedFlight> RotorDrivenFlight::Reference() const {
  std::unique_ptr<RotorDrivenFlight> flight(new RotorDrivenFlight(*this, false));
  if (options_.noise == bare_->noise) return flight;
  flight->options_.noise = options_.noise;
  if (!flight->Reweigh({})) flight->SolveFromPrior({});
  flight->bare_ = std::make_shared<const Fitted>(flight->fit_);
  return flight;
}

CatalogueScope RotorDrivenFlight::Scope() const {
  const RotorData& data = *fit_.setup->data;
  CatalogueScope scope;
  scope.applies = [this](const EffectInfo& info) { return AppliesTo(*fit_.setup, info); };
  scope.rotors = fit_.setup->model.num_rotors();
  scope.start = data.since_start + data.poses.front().t;
  scope.duration = data.poses.back().t - data.poses.front().t;
  return scope;
}

RotorBatchOptions RotorDrivenFlight::BatchOptions() const {
  return {options_.noise, fit_.setup->prior, options_.robust_pose};
}

void RotorDrivenFlight::Solve(const std::vector<Found>& found, const RotorBatchResult* start,
                              const RotorWeights* weights, bool rough) {
  fit_.found = found;
  fit_.noise = options_.noise;
  fit_.setup =
      std::make_shared<RotorSetup>(MakeRotorSetup(log_, options_, *lagged_, EffectsOf(found)));
  RotorBatchOptions options = BatchOptions();
  options.covariance = false;
  if (rough) {
    options.negligible = kNegligible;
    options.max_iterations = kRoughIterations;
  }
  fit_.batch = RunRotorBatch(fit_.setup->model, *fit_.setup->data, options, start, weights);
  normal_.reset();
}

bool RotorDrivenFlight::Reweigh(const std::vector<Found>& found) {
  const RotorBatchResult solved = fit_.batch;
  Solve(found, &solved, nullptr);
  if (std::isfinite(fit_.batch.cost) &&
      HasWeightsAt(fit_.setup->model, *fit_.setup->data, BatchOptions(), fit_.batch)) {
    fit_.weights = {fit_.setup, solved};
    return true;
  }
  fit_.batch = solved;
  return false;
}

void RotorDrivenFlight::ReweighOrShorten(const Fitted& regular, std::vector<Found>* found) {
  for (int k = 0; k < kMostIterations; ++k) {
    if (Reweigh(*found)) return;
    *found = Halfway(*found, regular.found);
    fit_.batch = regular.batch;
    fit_.weights = regular.weights;
  }
  *found = regular.found;
  SolveFromPrior(*found);
}

void RotorDrivenFlight::SolveFromPrior(const std::vector<Found>& found) {
  Solve(found, nullptr, nullptr);
  if (!Reweigh(found)) throw RunsAway();
}

std::vector<Found> RotorDrivenFlight::AtLastFit(const std::vector<Found>& found,
                                                bool* comparable) const {
  std::vector<Found> last = WithoutEffect(found);
  std::size_t known = 0;
  for (Found& f : last) {
    for (const Found& fitted : fit_.found) {
      if (fitted.candidate != f.candidate) continue;
      f.value = fitted.value;
      ++known;
    }
  }
  *comparable = known == fit_.found.size() && options_.noise == fit_.noise;
  return last;
}

bool RotorDrivenFlight::Move(const std::vector<Found>& before, std::vector<Found>* found) {
  const Fitted start = fit_;
  const RotorWeights weights = start.weights.By();
  const double most = start.batch.cost + kSameCost;
  Solve(*found, &start.batch, &weights, true);
  // Constants that absorbed part of the effect (inertia for a missing moment) make steps too long.
  for (int k = 0; k < kRepeats && fit_.batch.cost > most; ++k) {
    *found = Halfway(*found, before);
    Solve(*found, &start.batch, &weights, true);
  }
  if (fit_.batch.cost <= most) return true;
  Restore(start);
  *found = fit_.found = before;
  return false;
}

void RotorDrivenFlight::RefineValues(std::vector<Found>* found, int most_steps) {
  bool comparable = false;
  std::vector<Found> last = AtLastFit(*found, &comparable);
  if (!comparable) {
    Fitted without = fit_;
    without.found = WithoutEffect(last);
    ReweighOrShorten(without, &last);
  }
  Fitted regular = fit_;
  regular.found = last;
  if (comparable || last != *found) Move(last, found);
  for (int i = 0; i < most_steps && !found->empty(); ++i) {
    const std::vector<Found> before = *found;
    const double before_step = fit_.batch.cost;
    const bool settled = Step(found);
    if (!Move(before, found) || settled) break;
    if (before_step - fit_.batch.cost < kSameCost) break;
  }
  if (most_steps > 1) ReweighOrShorten(regular, found);
}

void RotorDrivenFlight::LearnNoiseAgain() {
  std::vector<std::string> causes;
  for (const Found& f : fit_.found) {
    const Candidate& c = f.candidate;
    causes.push_back(c.term ? c.term->Name() : c.Label());
  }
  if (const auto known = learned_.find(causes); known != learned_.end()) {
    options_.noise = known->second;
    return;
  }
  RotorEkfOptions filter{options_.noise, fit_.setup->prior, options_.wander};
  RotorDataOptions streams = options_.data;
  streams.motor_lag = fit_.setup->motor_lag;
  LearnFromFlight(fit_.setup->model, log_, {true, false, false, kLearnOn, stated_, kNearStrength},
                  &streams, &filter);
  learned_[causes] = options_.noise = filter.noise;
}

void RotorDrivenFlight::Fit(std::vector<Found>* found) {
  if (found->empty()) return Restore(*bare_);
  const auto known = std::ranges::find(kept_, *found, &Fitted::found);
  if (known != kept_.end()) return Restore(*known);
  if (learn_noise_) {
    RefineValues(found, 1);  // noise needs rough values
    LearnNoiseAgain();
  }
  RefineValues(found, kMostSteps);
  kept_.push_front(fit_);
  if (kept_.size() > kMostKept) kept_.pop_back();
}

void RotorDrivenFlight::Restore(const Fitted& fit) {
  fit_ = fit;
  options_.noise = fit.noise;
  normal_.reset();
}

std::vector<std::string> RotorDrivenFlight::Constants() const {
  std::vector<std::string> names;
  for (const int constant : fit_.setup->prior.Free())
    names.push_back(kRotorConstants[constant].name);
  return names;
}

std::vector<Effect> RotorDrivenFlight::KnownEffects() const {
  return EffectsBesideConstants(options_.effects, fit_.setup->prior);
}

}  // namespace trueline
