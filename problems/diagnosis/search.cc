#include "problems/diagnosis/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <fmt/format.h>

#include "problems/result/distributions.h"

namespace trueline {
namespace {

constexpr int kRelearned = 6;  // candidates for which the noise is learned anew

// What every attitude filter does to some extent is no cause but part of every flight: it takes
// some acceleration for gravity, and its integral winds up in turns. Nuisances with these priors.
struct OrdinaryError {
  EffectInfo info;
  double sigma;
};

const std::vector<OrdinaryError>& OrdinaryErrors() {
  static const std::vector<OrdinaryError> errors = {
      {InfoOf("ahrs_acceleration_error"), 0.05},  // 1/s
      {{"body_tilt_drift",
        EntersAt::kAttitude,
        {{"roll_1", "rad", 0.01, 0.1, 0.01},
         {"pitch_1", "rad", 0.01, 0.1, 0.01},
         {"roll_2", "rad", 0.01, 0.1, 0.01},
         {"pitch_2", "rad", 0.01, 0.1, 0.01}},
        "", ""},
       0.01}};  // rad
  return errors;
}

Columns FreeColumns(const Eigen::MatrixXd& d_rows) {
  return {d_rows, Eigen::VectorXd::Zero(d_rows.cols()), Eigen::VectorXd::Zero(d_rows.cols())};
}

Columns FilterNuisances(const SensitivityBase& base, const FlightUnknowns& x, BaseFlight* flight) {
  Columns all = Columns::None(flight->rows());
  for (const OrdinaryError& error : OrdinaryErrors()) {
    const Candidate candidate{&error.info, {}};
    Columns columns =
        FreeColumns(Sensitivity(base, candidate, candidate.Neutral(), x, flight));
    columns.precision.setConstant(1.0 / (error.sigma * error.sigma));
    all = all.With(columns);
  }
  return all;
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
    count += static_cast<int>(error.info.parameters.size());
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
      columns = columns.With(FreeColumns(Sensitivity(without, (*found)[k].candidate,
                                                     (*found)[k].value, fit_.x, flight_.get())));
    }
    flight_->SetForceEffects(ForceEffectsOf(effects_));
    fit_.columns = columns;
    Solve(flight_.get(), 5, &fit_);
    LearnNoise(fit_.Linear(*flight_), FilterColumns(), i == 0 ? 6 : 3, &fit_.noise);
    Solve(flight_.get(), 3, &fit_);
    StorePath();
    int at = FilterColumns();
    if (getenv("DG")) { fmt::print(stderr, "noise fix {:.3f} force {:.3f} gust {:.4f} mem {:.2f} acc {:.4f} tilt {:.5f} head {:.5f} mem {:.2f} theta {:.3f} {:.3f} {:.3f} k {:.3f}\n", fit_.noise.fix_scale, fit_.noise.force_sigma, fit_.noise.gust, fit_.noise.gust_memory, fit_.noise.process.acceleration, fit_.noise.process.tilt, fit_.noise.process.heading, fit_.noise.process.memory, Parameters()[0], Parameters()[1], Parameters()[2], fit_.columns.value.transpose()[0]); for (auto& f : *found) fmt::print(stderr, "  {} {} step {}\n", f.candidate.Label(), f.value[0], fit_.columns.value[at]); }
    for (Found& f : *found) {
      f.value += fit_.columns.value.segment(at, f.value.size());
      at += static_cast<int>(f.value.size());
    }
    if (found->empty()) break;
  }
}

void CauseSearch::LearnUnder(const Tested& tested, double base_evidence, Tested* out) const {
  const Columns all = fit_.columns.With(FreeColumns(tested.columns));
  NoiseStrengths noise = fit_.noise;
    const LinearFlight linear{*flight_, fit_.rows, fit_.x, fit_.weight, all};
  const double evidence = LearnNoise(linear, FilterColumns(), 2, &noise);
  out->gain = 2.0 * (evidence - base_evidence);
  const ChainSystem system(linear, noise);
  out->test = TestColumns(system, nuisances(), nuisances(), tested.candidate.Ordinary());
  out->test.LimitTo(std::max(0.0, out->gain));
}

std::vector<Tested> CauseSearch::TestAll(const std::vector<Candidate>& candidates) {
  const SensitivityBase base{log_, plan_, options_, effects_, path_};
  std::vector<Tested> tested;
  Columns all = fit_.columns;
  std::map<std::string, int> family;
  for (const Candidate& candidate : candidates) {
    flight_->Evaluate(fit_.x, false);
    Tested t{candidate, Sensitivity(base, candidate, candidate.Neutral(), fit_.x, flight_.get()),
             {}, 0.0, 1.0};
    ++family[candidate.info->id];
    tested.push_back(std::move(t));
  }
  int width = 0;
  for (const Tested& t : tested) width += static_cast<int>(t.columns.cols());
  Eigen::MatrixXd stacked(flight_->rows(), width);
  for (int at = 0; Tested& t : tested) {
    stacked.middleCols(at, t.columns.cols()) = t.columns;
    at += static_cast<int>(t.columns.cols());
  }
  all = all.With(FreeColumns(stacked));
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, fit_.weight, all},
                           fit_.noise);
  for (int at = nuisances(); Tested& t : tested) {
    const int size = static_cast<int>(t.columns.cols());
    t.test = TestColumns(system, nuisances(), at, t.candidate.Ordinary());
    t.gain = t.test.chi2;
    at += size;
  }
  std::vector<std::size_t> order(tested.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return tested[a].Merit() > tested[b].Merit(); });
  NoiseStrengths noise = fit_.noise;
  const double evidence = LearnNoise(fit_.Linear(*flight_), FilterColumns(), 2, &noise);
  for (int k = 0; k < std::min<int>(kRelearned, static_cast<int>(order.size())); ++k) {
    const Tested before = tested[order[k]];
    LearnUnder(before, evidence, &tested[order[k]]);
  }
  for (Tested& t : tested) {
    t.p = std::min(1.0, t.test.p() * family[t.candidate.info->id]);
  }
  return tested;
}

ScoreTest CauseSearch::TestFound(const std::vector<Found>& found, std::size_t which) const {
  // The found effect's columns moved to the end; all else is nuisance.
  int at = FilterColumns();
  for (std::size_t k = 0; k < which; ++k) at += static_cast<int>(found[k].value.size());
  const int size = static_cast<int>(found[which].value.size()), count = fit_.columns.count();
  Columns columns = fit_.columns;
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
  // Its evidence is that of its whole value, not of the last step.
  ScoreTest test = TestColumns(system, kThetaSize + count - size, kThetaSize + count - size,
                               found[which].candidate.Ordinary());
  test.Judge(found[which].value - found[which].candidate.Neutral(), plan_.clusters);
  return test;
}

std::vector<Eigen::VectorXd> CauseSearch::ValuesFrom(const std::vector<Found>& found,
                                                     const std::vector<bool>& used) const {
  Eigen::VectorXd weight = fit_.weight;
  for (int row = 0; row < weight.size(); ++row) {
    if (!used[flight_->ClusterOfRow(row)]) weight[row] = 0.0;
  }
  const ChainSystem system(LinearFlight{*flight_, fit_.rows, fit_.x, weight, fit_.columns},
                           fit_.noise);
  const Eigen::VectorXd step = -system.reduced().M.ldlt().solve(system.reduced().b);
  std::vector<Eigen::VectorXd> values;
  int at = kThetaSize + (FilterColumns());
  for (const Found& f : found) {
    values.push_back(f.value + step.segment(at, f.value.size()));
    at += static_cast<int>(f.value.size());
  }
  return values;
}

ThetaVector CauseSearch::Sigmas() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::MatrixXd cov = system.reduced().M.ldlt().solve(
      Eigen::MatrixXd::Identity(system.border(), system.border()));
  return ParameterScaling(options_).sigma.cwiseProduct(
      cov.diagonal().head<kThetaSize>().cwiseSqrt());
}

Eigen::VectorXd CauseSearch::Whitened() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  Eigen::VectorXd e(system.border() + 1);
  e << -system.reduced().M.ldlt().solve(system.reduced().b), 1.0;
  return system.Whitened(e);
}

}  // namespace trueline
