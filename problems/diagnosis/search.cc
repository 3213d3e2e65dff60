#include "problems/diagnosis/search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>

#include "problems/result/distributions.h"

namespace trueline {
namespace {

// An ordinary attitude filter takes some acceleration for gravity; up to about this gain (1/s) that
// is no cause but part of every flight, so it is a nuisance with this prior.
constexpr double kOrdinaryFilterGain = 0.05;
constexpr int kRelearned = 6;  // candidates for which the noise is learned anew

Columns FilterNuisance(const SensitivityBase& base, const FlightUnknowns& x, BaseFlight* flight) {
  const Candidate gain{&InfoOf("ahrs_acceleration_error"), {}};
  Columns columns;
  columns.d_rows = Sensitivity(base, gain, Eigen::VectorXd::Zero(1), x, flight);
  columns.precision =
      Eigen::VectorXd::Constant(1, 1.0 / (kOrdinaryFilterGain * kOrdinaryFilterGain));
  columns.value = Eigen::VectorXd::Zero(1);
  return columns;
}

Columns FreeColumns(const Eigen::MatrixXd& d_rows) {
  return {d_rows, Eigen::VectorXd::Zero(d_rows.cols()), Eigen::VectorXd::Zero(d_rows.cols())};
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

Eigen::Vector3d CauseSearch::AccelBias() const {
  const ThetaVector p = Parameters();
  return started_ ? Eigen::Vector3d(p[9], p[10], p[2]) : Eigen::Vector3d::Zero();
}

void CauseSearch::Rebuild(const std::vector<Found>& found) {
  effects_.clear();
  for (const Found& f : found) effects_.push_back(f.candidate.At(f.value));
  const Eigen::Vector3d bias = AccelBias();
  corrected_ = CorrectLog(log_, effects_, bias);
  flight_ = std::make_unique<BaseFlight>(corrected_, plan_, options_, ForceEffectsOf(effects_));
  if (!started_) {
    fit_.x = flight_->RoughStart(data_.passes);
    fit_.noise = StartingNoise(*flight_, options_);
    fit_.columns = Columns::None(flight_->rows());
    Solve(flight_.get(), 8, &fit_);
    started_ = true;
  }
}

void CauseSearch::Fit(std::vector<Found>* found, int refits) {
  for (int i = 0; i <= refits; ++i) {
    Rebuild(*found);
    flight_->Evaluate(fit_.x, false);
    const SensitivityBase base{log_, plan_, options_, effects_, AccelBias()};
    const bool attitude = !log_.attitude.empty();
    Columns columns =
        attitude ? FilterNuisance(base, fit_.x, flight_.get()) : Columns::None(flight_->rows());
    for (std::size_t k = 0; k < found->size(); ++k) {
      std::vector<Effect> others = effects_;
      others.erase(others.begin() + static_cast<long>(k));
      const SensitivityBase without{log_, plan_, options_, others, AccelBias()};
      columns = columns.With(FreeColumns(Sensitivity(without, (*found)[k].candidate,
                                                     (*found)[k].value, fit_.x, flight_.get())));
    }
    flight_->SetForceEffects(ForceEffectsOf(effects_));
    fit_.columns = columns;
    Solve(flight_.get(), 5, &fit_);
    LearnNoise(*flight_, fit_.rows, fit_.x, fit_.weight, fit_.columns, attitude ? 1 : 0,
               i == 0 ? 6 : 3, &fit_.noise);
    Solve(flight_.get(), 3, &fit_);
    int at = attitude ? 1 : 0;
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
  const int attitude = log_.attitude.empty() ? 0 : 1;
  const double evidence = LearnNoise(*flight_, fit_.rows, fit_.x, fit_.weight, all, attitude, 2,
                                     &noise);
  out->gain = 2.0 * (evidence - base_evidence);
  const ChainSystem system(*flight_, fit_.rows, fit_.x, fit_.weight, all, noise);
  out->test = TestColumns(system, nuisances(), nuisances(), static_cast<int>(tested.columns.cols()));
  out->test.p_model = ChiSquareTail(std::max(0.0, out->gain), out->test.value.size());
}

std::vector<Tested> CauseSearch::TestAll(const std::vector<Candidate>& candidates) {
  const SensitivityBase base{log_, plan_, options_, effects_, AccelBias()};
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
  const ChainSystem system(*flight_, fit_.rows, fit_.x, fit_.weight, all, fit_.noise);
  for (int at = nuisances(); Tested& t : tested) {
    const int size = static_cast<int>(t.columns.cols());
    t.test = TestColumns(system, nuisances(), at, size);
    t.gain = t.test.chi2;
    at += size;
  }
  std::vector<std::size_t> order(tested.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return tested[a].Merit() > tested[b].Merit(); });
  NoiseStrengths noise = fit_.noise;
  const double evidence = LearnNoise(*flight_, fit_.rows, fit_.x, fit_.weight, fit_.columns,
                                     log_.attitude.empty() ? 0 : 1, 2, &noise);
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
  int at = log_.attitude.empty() ? 0 : 1;
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
  const ChainSystem system(*flight_, fit_.rows, fit_.x, fit_.weight, columns, fit_.noise);
  ScoreTest test = TestColumns(system, kThetaSize + count - size, kThetaSize + count - size, size);
  // Its evidence is that of its whole value, not of the last step.
  const Eigen::VectorXd value = found[which].value - found[which].candidate.Neutral();
  const Eigen::VectorXd model_sigma =
      (test.information + 1e-12 * test.information.diagonal().maxCoeff() *
                              Eigen::MatrixXd::Identity(size, size))
          .inverse()
          .diagonal()
          .cwiseSqrt();
  const double widening = test.sigma.cwiseQuotient(model_sigma).maxCoeff();
  test.chi2 = value.dot(test.information * value);
  test.p_model = ChiSquareTail(test.chi2, size);
  const double f = test.chi2 / (widening * widening * size);
  test.p_cluster = FTail(f, size, std::max(1, plan_.clusters - size));
  return test;
}

std::vector<Eigen::VectorXd> CauseSearch::ValuesFrom(const std::vector<Found>& found,
                                                     const std::vector<bool>& used) const {
  Eigen::VectorXd weight = fit_.weight;
  for (int row = 0; row < weight.size(); ++row) {
    if (!used[flight_->ClusterOfRow(row)]) weight[row] = 0.0;
  }
  const ChainSystem system(*flight_, fit_.rows, fit_.x, weight, fit_.columns, fit_.noise);
  const Eigen::VectorXd step = -system.reduced().M.ldlt().solve(system.reduced().b);
  std::vector<Eigen::VectorXd> values;
  int at = kThetaSize + (log_.attitude.empty() ? 0 : 1);
  for (const Found& f : found) {
    values.push_back(f.value + step.segment(at, f.value.size()));
    at += static_cast<int>(f.value.size());
  }
  return values;
}

ThetaVector CauseSearch::Sigmas() const {
  const ChainSystem system(*flight_, fit_.rows, fit_.x, fit_.weight, fit_.columns, fit_.noise);
  const Eigen::MatrixXd cov = system.reduced().M.ldlt().solve(
      Eigen::MatrixXd::Identity(system.border(), system.border()));
  return ParameterScaling(options_).sigma.cwiseProduct(
      cov.diagonal().head<kThetaSize>().cwiseSqrt());
}

Eigen::VectorXd CauseSearch::Whitened() const {
  const ChainSystem system(*flight_, fit_.rows, fit_.x, fit_.weight, fit_.columns, fit_.noise);
  Eigen::VectorXd e(system.border() + 1);
  e << -system.reduced().M.ldlt().solve(system.reduced().b), 1.0;
  return system.Whitened(e);
}

}  // namespace trueline
