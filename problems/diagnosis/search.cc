#include "problems/diagnosis/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "problems/common/parallel.h"
#include "problems/diagnosis/library.h"
#include "problems/diagnosis/verdict.h"

namespace trueline {
namespace {

constexpr int kRelearned = 6;  // candidates that are tested with noise learned again

// Errors that every vehicle has to some extent are nuisances with these priors: the attitude filter
// mistakes some acceleration for gravity and its integral winds up in turns; the thrust axis
// measures a share of the other two, which grows with drag.
struct OrdinaryError {
  const EffectInfo* info;
  double sigma;  // of each parameter, in its unit
};

const std::vector<OrdinaryError>& OrdinaryErrors() {
  static const std::vector<OrdinaryError> errors = {
      {&InfoOf("ahrs_acceleration_error"), 0.05},
      {&InfoOf("body_tilt_drift"), 0.01},
      // Beside the misalignment of the axes, which eq. 15 leaves out of a_z.
      {&InfoOf("accel_cross_axis"), 0.01}};
  return errors;
}

Columns FreeColumns(const Eigen::MatrixXd& d_rows) {
  return {d_rows, Eigen::VectorXd::Zero(d_rows.cols()), Eigen::VectorXd::Zero(d_rows.cols())};
}

Columns FilterNuisances(const SensitivityBase& base, const FlightUnknowns& x, BaseFlight* flight) {
  Columns all = Columns::None(flight->rows());
  for (const OrdinaryError& error : OrdinaryErrors()) {
    const Candidate candidate{error.info, {}};
    Columns columns = FreeColumns(Sensitivity(base, candidate, candidate.Neutral(), x, flight));
    columns.precision.setConstant(1.0 / (error.sigma * error.sigma));
    all = all.With(columns);
  }
  return all;
}

// Moves the found effects by `step`, clamped to plausible values. True once the move is small
// against the steps of the difference quotients. Because the noise is learned again each time,
// steps shrink by a constant ratio; Aitken extrapolation uses two of them, so the first step never
// converges.
bool Advance(const Eigen::VectorXd& step, Eigen::VectorXd* last, std::vector<Found>* found) {
  constexpr double kFurthest = 4.0;  // times the step
  bool settled = last->size() > 0 || step.size() == 0;
  int at = 0;
  for (Found& f : *found) {
    for (int k = 0; k < f.value.size(); ++k, ++at) {
      const EffectParameterInfo& info = f.candidate.info->parameters[k];
      const double ratio = last->size() > 0 ? step[at] / (*last)[at] : 0.0;
      const double ahead = ratio > 0.0 && ratio < 1.0 ? 1.0 / (1.0 - ratio) : 1.0;
      const double move = step[at] * std::min(kFurthest, ahead);
      f.value[k] = std::clamp(f.value[k] + move, -info.plausible, info.plausible);
      settled = settled && std::abs(move) < 0.2 * info.step;
    }
  }
  *last = step;
  return settled;
}

}  // namespace

CauseSearch::CauseSearch(const FlightLog& log, const VgdOptions& options)
    : log_(log),
      options_(options),
      data_(log, options.drive, options.passes, options.drag_measurement),
      plan_(FlightPlan::For(data_, options)) {}

ThetaVector CauseSearch::Parameters() const {
  const ParameterScaling scaling(options_);
  return scaling.mean + scaling.sigma.cwiseProduct(fit_.x.theta);
}

int CauseSearch::FilterColumns() const {
  if (log_.attitude.empty()) return 0;
  int count = 0;
  for (const OrdinaryError& error : OrdinaryErrors()) {
    count += static_cast<int>(error.info->parameters.size());
  }
  return count;
}

void CauseSearch::StorePath() {
  path_.clear();
  for (std::size_t s = 0; s < plan_.segments.size(); ++s) {
    path_.push_back({plan_.segments[s].begin, fit_.x.nodes[s].segment<3>(kStateAt + 3)});
  }
}

void CauseSearch::Rebuild(const std::vector<Found>& found) {
  effects_.clear();
  for (const Found& f : found) effects_.push_back(f.candidate.At(f.value));
  corrected_ = CorrectLog(log_, effects_, path_);
  flight_ = std::make_unique<BaseFlight>(corrected_, plan_, options_, ForceEffectsOf(effects_));
  if (!started_) {
    fit_.x = flight_->RoughStart(data_.passes);
    fit_.noise = StartingNoise(options_);
    fit_.columns = Columns::None(flight_->rows());
    Solve(flight_.get(), 8, &fit_);
    StorePath();
    started_ = true;
  }
}

void CauseSearch::Fit(std::vector<Found>* found, int refits) {
  FitFromHere(found, refits);
  if (IsSound()) return;
  // Far from the optimum Gauss-Newton may diverge: restart from the fixes, without effects.
  for (Found& f : *found) f.value = f.candidate.Neutral();
  started_ = false;
  std::vector<Found> none;
  FitFromHere(&none, 0);
  FitFromHere(found, refits);
}

bool CauseSearch::IsSound() const {
  constexpr double kMostScatter = 100.0;  // of fixes, times what is stated
  return fit_.x.theta.allFinite() && fit_.noise.fix_scale < kMostScatter &&
         std::all_of(fit_.x.nodes.begin(), fit_.x.nodes.end(),
                     [](const NodeVector& node) { return node.allFinite(); });
}

void CauseSearch::FitFromHere(std::vector<Found>* found, int refits) {
  Eigen::VectorXd last;
  for (int i = 0; i <= refits; ++i) {
    Rebuild(*found);
    flight_->Evaluate(fit_.x, false);
    const SensitivityBase base{log_, plan_, options_, effects_, path_};
    const bool attitude = !log_.attitude.empty();
    Columns columns =
        attitude ? FilterNuisances(base, fit_.x, flight_.get()) : Columns::None(flight_->rows());
    for (std::size_t k = 0; k < found->size(); ++k) {
      std::vector<Effect> others = effects_;
      others.erase(others.begin() + static_cast<long>(k));
      const SensitivityBase without{log_, plan_, options_, others, path_};
      columns = columns.With(FreeColumns(
          Sensitivity(without, (*found)[k].candidate, (*found)[k].value, fit_.x, flight_.get())));
    }
    flight_->SetForceEffects(ForceEffectsOf(effects_));
    fit_.columns = columns;
    Solve(flight_.get(), 5, &fit_);
    LearnNoise(fit_.Linear(*flight_), FilterColumns(), i == 0 ? 6 : 3, &fit_.noise);
    Solve(flight_.get(), 3, &fit_);
    StorePath();
    const int at = FilterColumns();
    if (Advance(fit_.columns.value.tail(fit_.columns.count() - at), &last, found)) break;
  }
}

void CauseSearch::TestTogether(std::vector<Tested>* tested) const {
  int width = 0;
  for (const Tested& t : *tested) width += static_cast<int>(t.columns.cols());
  Eigen::MatrixXd stacked(flight_->rows(), width);
  for (int at = 0; const Tested& t : *tested) {
    stacked.middleCols(at, t.columns.cols()) = t.columns;
    at += static_cast<int>(t.columns.cols());
  }
  const Columns all = fit_.columns.With(FreeColumns(stacked));
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, fit_.weight, all}, fit_.noise);
  const ReducedSystem reduced = system.ByCluster();
  for (int at = nuisances(); Tested & t : *tested) {
    t.test = TestColumns(reduced, nuisances(), at, t.ordinary);
    t.gain = t.test.chi2;
    at += static_cast<int>(t.columns.cols());
  }
}

// The noise was learned without the candidates and includes what they explain. The most promising
// candidates are judged with noise learned again.
void CauseSearch::RelearnBest(std::vector<Tested>* tested) const {
  std::vector<std::size_t> order(tested->size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return (*tested)[a].Merit() > (*tested)[b].Merit();
  });
  // Learned noise so large that it hides a real effect is far from the right candidate's noise.
  const int sweeps = ExtraordinaryNoise(fit_.noise).empty() ? 2 : 6;
  NoiseStrengths noise = fit_.noise;
  const double evidence = LearnNoise(fit_.Linear(*flight_), FilterColumns(), sweeps, &noise);
  ParallelFor(std::min<int>(kRelearned, static_cast<int>(order.size())), 0,
              [&](int k) { LearnUnder(evidence, sweeps, &(*tested)[order[k]]); });
}

void CauseSearch::LearnUnder(double base_evidence, int sweeps, Tested* tested) const {
  const Columns all = fit_.columns.With(FreeColumns(tested->columns));
  NoiseStrengths noise = fit_.noise;
  const LinearFlight linear{*flight_, fit_.rows, fit_.x, fit_.weight, all};
  tested->gain = 2.0 * (LearnNoise(linear, FilterColumns(), sweeps, &noise) - base_evidence);
  const ChainSystem system(linear, noise);
  tested->test = TestColumns(system.ByCluster(), nuisances(), nuisances(), tested->ordinary);
  tested->test.LimitTo(std::max(0.0, tested->gain));
}

std::vector<Tested> CauseSearch::TestAll(const std::vector<Candidate>& candidates) {
  const SensitivityBase base{log_, plan_, options_, effects_, path_};
  std::vector<Tested> tested;
  std::map<std::string, int> family;
  for (const Candidate& candidate : candidates) {
    flight_->Evaluate(fit_.x, false);
    ++family[candidate.info->id];
    tested.push_back({candidate,
                      Sensitivity(base, candidate, candidate.Neutral(), fit_.x, flight_.get()),
                      candidate.Ordinary(), ScoreTest(), 0.0, 1.0});
  }
  if (tested.empty()) return tested;
  TestTogether(&tested);
  RelearnBest(&tested);
  for (Tested& t : tested) t.p = std::min(1.0, t.test.p() * family[t.candidate.info->id]);
  return tested;
}

std::vector<CauseSearch::Described> CauseSearch::TestLibrary() {
  const std::vector<LibraryTerm> terms = LibraryTerms(flight_.get(), fit_.x);
  std::vector<Tested> tested;
  tested.reserve(terms.size());
  for (const LibraryTerm& term : terms) {
    tested.push_back({Candidate{nullptr, {}}, term.columns, term.ordinary, ScoreTest(), 0.0, 1.0});
  }
  TestTogether(&tested);
  RelearnBest(&tested);
  std::vector<Described> described;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    described.push_back({terms[i].name, tested[i].test.p(), tested[i].Merit(), terms[i].columns});
  }
  std::sort(described.begin(), described.end(),
            [](const Described& a, const Described& b) { return a.merit > b.merit; });
  return described;
}

ScoreTest CauseSearch::TestFound(const std::vector<Found>& found, std::size_t which) const {
  return TestFound(found, which, Eigen::MatrixXd(flight_->rows(), 0));
}

ScoreTest CauseSearch::TestFound(const std::vector<Found>& found, std::size_t which,
                                 const Eigen::MatrixXd& beside) const {
  // Moves the found effect's columns to the end; all others are nuisances.
  int at = FilterColumns();
  for (std::size_t k = 0; k < which; ++k) at += static_cast<int>(found[k].value.size());
  Columns columns = fit_.columns.With(FreeColumns(beside));
  const int size = static_cast<int>(found[which].value.size()), count = columns.count();
  Eigen::PermutationMatrix<Eigen::Dynamic> order(count);
  int to = 0;
  for (int c = 0; c < count; ++c) {
    if (c < at || c >= at + size) order.indices()[c] = to++;
  }
  for (int c = at; c < at + size; ++c) order.indices()[c] = to++;
  columns.d_rows = columns.d_rows * order.inverse();
  columns.precision = order * columns.precision;
  columns.value = order * columns.value;
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, fit_.weight, columns},
                           fit_.noise);
  // The whole value is judged. The last step is added only if nuisance columns may replace the
  // effect.
  ScoreTest test = TestColumns(system.ByCluster(), kThetaSize + count - size,
                               kThetaSize + count - size, found[which].candidate.Ordinary());
  Eigen::VectorXd whole = found[which].value - found[which].candidate.Neutral();
  if (beside.cols() > 0) whole += test.value;
  test.Judge(whole, plan_.clusters);
  return test;
}

PartFit CauseSearch::FitOf(const std::vector<Found>& found, const std::vector<bool>& used) const {
  Eigen::VectorXd weight = fit_.weight;
  for (int row = 0; row < weight.size(); ++row) {
    if (!used[flight_->ClusterOfRow(row)]) weight[row] = 0.0;
  }
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, weight, fit_.columns},
                           fit_.noise);
  const ParameterScaling scaling(options_);
  const Eigen::MatrixXd cov = system.reduced().Covariance();
  const Eigen::VectorXd step = system.reduced().Solution();
  const ThetaVector theta = fit_.x.theta + step.head<kThetaSize>();
  PartFit part{scaling.mean + scaling.sigma.cwiseProduct(theta),
               scaling.sigma.cwiseProduct(cov.diagonal().head<kThetaSize>().cwiseSqrt()),
               {}};
  int at = kThetaSize + FilterColumns();
  for (const Found& f : found) {
    part.effects.push_back(f.candidate.At(f.value + step.segment(at, f.value.size())));
    at += static_cast<int>(f.value.size());
  }
  return part;
}

ThetaVector CauseSearch::Sigmas() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::MatrixXd cov = system.reduced().Covariance();
  return ParameterScaling(options_).sigma.cwiseProduct(
      cov.diagonal().head<kThetaSize>().cwiseSqrt());
}

Eigen::VectorXd CauseSearch::Whitened() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  return system.Whitened(system.reduced().Fitted());
}

}  // namespace trueline
