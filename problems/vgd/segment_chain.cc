#include "problems/vgd/segment_chain.h"

#include <ceres/normal_prior.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "cost_functions/drag_residual.h"
#include "problems/common/parallel.h"
#include "problems/common/units.h"
#include "problems/vgd/solver_options.h"

namespace trueline {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMostRows = kThetaSize + kNodeSize;  // of a term
constexpr int kMostColumns = kThetaSize + 2 * kNodeSize + SegmentChain::kMostBorder;

ceres::CostFunction* ZeroPrior(const Eigen::VectorXd& weight) {
  return new ceres::NormalPrior(Eigen::MatrixXd(weight.asDiagonal()),
                                Eigen::VectorXd::Zero(weight.size()));
}

}  // namespace

SegmentChain::SegmentChain(const VgdOptions& options) : options_(options), scaling_(options) {}

void SegmentChain::AddTheta() {
  x_.theta.emplace_back(ThetaVector::Zero());
  begin_of_.push_back(size());
}

void SegmentChain::AddSegment(std::unique_ptr<Segment> segment, bool linked) {
  segments_.push_back(std::move(segment));
  theta_of_.push_back(x_.theta.size() - 1);
  linked_.push_back(linked);
  terms_.emplace_back();
  x_.nodes.emplace_back(NodeVector::Zero());
}

Gusts SegmentChain::GustsOf(std::size_t s) const {
  if (!HasGusts()) return Gusts::kNone;
  return IsLinked(s) ? Gusts::kLinked : Gusts::kHeld;
}

GustSlope<6> SegmentChain::StateGusts(std::size_t s, TimeNs t) const {
  return {GustsOf(s), segments_[s]->StateGustsAt(t)};
}

GustSlope<2> SegmentChain::ForceGusts(std::size_t s, TimeNs t) const {
  return {GustsOf(s), segments_[s]->ForceGustsAt(t)};
}

SegmentChain::Term& SegmentChain::NewTerm(std::vector<Term>* terms, ceres::CostFunction* cost,
                                          ceres::LossFunction* loss) {
  CHECK_LE(cost->num_residuals(), kMostRows);
  Term& term = terms->emplace_back();
  term.cost.reset(cost);
  term.loss.reset(loss);
  return term;
}

double* SegmentChain::AddBorder(std::size_t s, const Eigen::VectorXd& weight, bool local) {
  CHECK(!normal_ && weight.size() <= kMostBorder);
  const int size = static_cast<int>(weight.size());
  if (local) {
    CHECK_EQ(local_size_, border_size_);
    local_size_ = size;
  }
  const int column = Normal::kBorderAt + (local ? 0 : border_size_);
  border_size_ = column + size - Normal::kBorderAt;
  double* data = x_.border.emplace_back(Eigen::Matrix<double, kMostBorder, 1>::Zero()).data();
  border_.push_back({{data, size, column}, theta_of_[s], local});
  NewTerm(&terms_[s], ZeroPrior(weight), nullptr).Add(border_.back().block);
  return data;
}

void SegmentChain::AddReading(std::size_t s, ceres::CostFunction* cost, ceres::LossFunction* loss,
                              const std::vector<double*>& border) {
  Term& term = NewTerm(&terms_[s], cost, loss);
  term.Add(ThetaBlock(s));
  term.Add(PathBlock(s, Normal::kNodeAt));
  if (HasGusts()) term.Add(GustBlock(s, Normal::kNodeAt));
  if (GustsOf(s) == Gusts::kLinked) term.Add(GustBlock(s + 1, Normal::kNextAt));
  for (const double* data : border) term.Add(BorderBlock(data));
}

SegmentChain::Term::Block SegmentChain::BorderBlock(const double* data) const {
  return std::find_if(border_.begin(), border_.end(),
                      [data](const Border& candidate) { return candidate.block.data == data; })
      ->block;
}

void SegmentChain::AddStarts(std::size_t s, ceres::CostFunction* cost, ceres::LossFunction* loss,
                             const double* border) {
  CHECK(IsLinked(s));
  Term& term = NewTerm(&terms_[s], cost, loss);
  term.Add(PathBlock(s, Normal::kNodeAt));
  term.Add(PathBlock(s + 1, Normal::kNextAt));
  term.Add(BorderBlock(border));
}

void SegmentChain::AddForce(std::size_t s, const ForceSample& force, double sigma) {
  has_forces_ = true;
  AddReading(s,
             new DragResidual(segments_[s]->ForceAt(force.t), {force.accel_xy, sigma},
                              ForceGusts(s, force.t)),
             new ceres::HuberLoss(kForceHuber));
}

void SegmentChain::AddStep(std::size_t s, double gravity) {
  const Segment& segment = *segments_[s];
  const ContinuityResidual::Weights weights =
      StepWeights(options_.process, scaling_.DriftUnit(), segment, gravity);
  log_weights_ += LogDeterminant(weights, HasGusts());
  Term& term = NewTerm(
      &terms_[s], new ContinuityResidual(segment.end_node(), weights, StateGusts(s, segment.end())),
      nullptr);
  term.Add(ThetaBlock(s));
  term.Add(PathBlock(s, Normal::kNodeAt));
  term.Add(PathBlock(s + 1, Normal::kNextAt));
  if (!HasGusts()) return;
  term.Add(GustBlock(s, Normal::kNodeAt));
  term.Add(GustBlock(s + 1, Normal::kNextAt));
}

void SegmentChain::AddThetaStep(std::size_t section, ceres::CostFunction* cost) {
  CHECK_EQ(theta_steps_.size(), section);
  Term& term = NewTerm(&theta_steps_, cost, nullptr);
  term.Add({x_.theta[section].data(), kThetaSize, Normal::kSharedAt});
  term.Add({x_.theta[section + 1].data(), kThetaSize, Normal::kNextSharedAt});
}

void SegmentChain::AddStart(std::size_t s) {
  const Eigen::Vector3d drift = options_.process.StartSigma();
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(kGustAt);
  weight.head<kDriftSize>() = scaling_.DriftUnit().cwiseQuotient(drift);
  log_weights_ -= drift.array().log().sum();
  NewTerm(&terms_[s], ZeroPrior(weight), nullptr).Add(PathBlock(s, Normal::kNodeAt));
  if (!HasGusts()) return;
  log_weights_ -= kGustSize * std::log(options_.process.gust);
  weight = Eigen::Vector2d::Constant(1.0 / options_.process.gust);
  NewTerm(&terms_[s], ZeroPrior(weight), nullptr).Add(GustBlock(s, Normal::kNodeAt));
}

void SegmentChain::AddThetaPrior(std::size_t s, const ThetaVector& weight) {
  factorised_.reset();
  problem_.reset();
  NewTerm(&terms_[s], ZeroPrior(weight), nullptr).Add(ThetaBlock(s));
}

void SegmentChain::AddNodePrior(std::size_t s, ceres::CostFunction* cost) {
  Term& term = NewTerm(&terms_[s], cost, nullptr);
  term.Add(ThetaBlock(s));
  term.Add(PathBlock(s, Normal::kNodeAt));
  if (HasGusts()) term.Add(GustBlock(s, Normal::kNodeAt));
}

void SegmentChain::HoldTheta(bool hold) {
  theta_held_ = hold;
  factorised_.reset();
  problem_.reset();
}

std::size_t SegmentChain::SegmentAt(TimeNs t, std::size_t first, std::size_t end) const {
  const auto after = std::upper_bound(
      segments_.begin() + static_cast<long>(first) + 1, segments_.begin() + static_cast<long>(end),
      t, [](TimeNs time, const auto& segment) { return time < segment->start(); });
  return static_cast<std::size_t>(after - segments_.begin()) - 1;
}

void SegmentChain::SetState(std::size_t s, const Eigen::Vector3d& p, const Eigen::Vector3d& v) {
  x_.nodes[s].setZero();
  x_.nodes[s].segment<kStateSize>(kStateAt) << p, v;
}

void SegmentChain::PrepareForEvaluation(bool evaluate_jacobians, bool /*new_evaluation_point*/) {
  Refresh(evaluate_jacobians);
}

// The same point is evaluated repeatedly. Values elsewhere leave the derivatives as they are.
void SegmentChain::Refresh(bool derivatives) {
  derivatives = derivatives && !(x_ == derivatives_at_);
  if (x_ == values_at_ && !derivatives) return;
  constexpr int kInARow = 64;  // segments; a window has fewer and stays on its thread
  ParallelRuns(static_cast<int>(segments_.size()), kInARow,
               [&](int s) { Integrate(static_cast<std::size_t>(s), derivatives); });
  values_at_ = x_;
  if (derivatives) derivatives_at_ = x_;
}

void SegmentChain::Integrate(std::size_t s) { Integrate(s, false); }

void SegmentChain::Integrate(std::size_t s, bool derivatives) {
  const NodeVector& node = x_.nodes[s];
  segments_[s]->Evaluate(x_.theta[theta_of_[s]].data(), node.data(), node.data() + kStateAt,
                         derivatives);
  if (!HasGusts()) return;
  GustPair gusts;
  gusts << node.tail<kGustSize>(), x_.nodes[IsLinked(s) ? s + 1 : s].tail<kGustSize>();
  segments_[s]->AddGusts(gusts);
}

double SegmentChain::Evaluate(const Term& term, double* rows) const {
  std::array<const double*, 6> x;
  std::array<double*, 6> jacobians;
  double residuals[kMostRows], derivatives[kMostRows * kMostColumns];
  const int count = term.cost->num_residuals();
  double* next = derivatives;
  for (int b = 0; b < term.count; ++b) {
    x[b] = term.blocks[b].data;
    jacobians[b] = next;
    next += count * term.blocks[b].size;
  }
  if (!term.cost->Evaluate(x.data(), residuals, rows != nullptr ? jacobians.data() : nullptr)) {
    return kInfinity;
  }
  double rho[3] = {0.0, 1.0, 0.0};
  for (int i = 0; i < count; ++i) rho[0] += residuals[i] * residuals[i];
  if (term.loss != nullptr) term.loss->Evaluate(rho[0], rho);
  if (rows == nullptr) return 0.5 * rho[0];
  // Ceres' correction of a loss without positive curvature, as all of this project's are.
  const double weight = std::sqrt(rho[1]);
  const int width = normal_->width();
  std::fill_n(rows, count * width, 0.0);
  for (int i = 0; i < count; ++i) rows[(i + 1) * width - 1] = weight * residuals[i];
  for (int b = 0; b < term.count; ++b) {
    const auto& [data, size, column] = term.blocks[b];
    if (theta_held_ && column == Normal::kSharedAt) continue;
    const int held = drift_held_ && column == Normal::kNodeAt ? kDriftSize : 0;
    for (int i = 0; i < count; ++i) {
      for (int j = held; j < size; ++j) {
        rows[i * width + column + j] = weight * jacobians[b][i * size + j];
      }
    }
  }
  return 0.5 * rho[0];
}

double SegmentChain::Cost() const {
  double cost = 0.0;
  for (const std::vector<Term>& terms : terms_) {
    for (const Term& term : terms) cost += Evaluate(term, nullptr);
  }
  for (const Term& term : theta_steps_) cost += Evaluate(term, nullptr);
  return cost;
}

SegmentChain::Normal& SegmentChain::normal() {
  if (normal_) return *normal_;
  normal_.emplace(border_size_, local_size_);
  normal_->Reserve(size() * kNodeSize + x_.theta.size() * (kThetaSize + local_size_) +
                   border_size_);
  segment_of_.assign(size() + x_.theta.size(), -1);
  for (std::size_t s = 0; s < size(); ++s) segment_of_[BlockOf(s)] = static_cast<int>(s);
  return *normal_;
}

int SegmentChain::FillRows(std::span<const Term> terms, double* cost) {
  const std::size_t width = normal().width();
  std::size_t count = 0, at = 0;
  for (const Term& term : terms) count += term.cost->num_residuals();
  if (rows_.size() < count * width) rows_.resize(count * width);
  for (const Term& term : terms) {
    *cost += Evaluate(term, rows_.data() + at * width);
    at += term.cost->num_residuals();
  }
  return static_cast<int>(count);
}

double SegmentChain::Linearise(double radius) {
  Refresh(true);
  factorised_.reset();
  normal().Begin(radius);
  double cost = 0.0;
  const auto add = [&](std::span<const Term> terms) {
    const int count = FillRows(terms, &cost);
    normal_->AddRows(rows_.data(), count);
  };
  for (std::size_t s = 0; s < size(); ++s) {
    add(terms_[s]);
    normal_->EndNode();
    const std::size_t section = theta_of_[s];
    if (s + 1 == size() || s + 1 != EndOf(section)) continue;
    add({&theta_steps_[section], 1});
    normal_->EndSection();
  }
  normal_->EndChain();
  return cost;
}

double SegmentChain::Factorise() {
  if (!factorised_ || !(factorised_at_ == x_)) {
    factorised_ = Linearise(kInfinity);
    factorised_at_ = x_;
  }
  return *factorised_;
}

double SegmentChain::LogEvidence() {
  const double cost = Factorise();
  return log_weights_ - cost - 0.5 * normal_->log_det();
}

Eigen::MatrixXd SegmentChain::Covariance(int count, const AddSlopes& add) {
  Factorise();
  return normal_->Covariance(count, [&](int block, Columns* G) {
    if (segment_of_[block] >= 0) add(static_cast<std::size_t>(segment_of_[block]), G);
  });
}

void SegmentChain::VisitCovariances(const VisitCovariance& visit) {
  Factorise();
  normal_->VisitCovariances([&](int block, const Eigen::MatrixXd& F) {
    if (segment_of_[block] >= 0) visit(static_cast<std::size_t>(segment_of_[block]), F);
  });
}

SegmentChain::Columns SegmentChain::Rows(std::size_t s) {
  Refresh(true);
  double cost = 0.0;
  const int count = FillRows(terms_[s], &cost);
  return Eigen::Map<const Columns>(rows_.data(), count, normal_->width());
}

void SegmentChain::AddDragErrors(std::size_t s, const Eigen::MatrixXd& F, int segments,
                                 DragErrors* drag_errors) const {
  constexpr int kVelocityAt = kStateAt + 3;
  const Eigen::Matrix<double, 3, 2> axes = segments_[s]->BodyAxesAtStart();
  const Eigen::Matrix2d cov = axes.transpose() * F.block<3, 3>(kVelocityAt, kVelocityAt) * axes;
  const double by_gusts =
      options_.UsesGusts() ? options_.process.gust * options_.process.gust_memory : 0.0;
  drag_errors->Add(axes.transpose() * x_.nodes[s].segment<3>(kVelocityAt), cov.diagonal(), by_gusts,
                   segments * segments_[s]->force_count());
}

std::pair<double, double> SegmentChain::ScaledBounds(int parameter) const {
  const ParameterPrior& prior = options_.priors[parameter];
  return {(prior.lower - prior.mean) / prior.sigma, (prior.upper - prior.mean) / prior.sigma};
}

// A chain as a problem for MinimiseInTrustRegion.
class SegmentChain::Minimiser {
 public:
  explicit Minimiser(SegmentChain* chain) : chain_(*chain) { chain_.normal().ForgetUnits(); }

  double Linearise(double radius, double* cost) {
    start_ = chain_.x_;
    *cost = chain_.Linearise(radius);
    return chain_.normal_->Solve();
  }

  double Try() {
    Unknowns& x = chain_.x_;
    step_ = norm_ = 0.0;
    const auto move = [&](int block, int at, int size, double* to) {
      const double* step = chain_.normal_->step(block) + at;
      for (int i = 0; i < size; ++i) {
        norm_ += to[i] * to[i];
        step_ += step[i] * step[i];
        to[i] += step[i];
      }
    };
    for (std::size_t s = 0; s < chain_.size(); ++s) {
      move(chain_.BlockOf(s), 0, kNodeSize, x.nodes[s].data());
    }
    for (std::size_t k = 0; k < x.theta.size(); ++k) {
      move(chain_.BlockOfSection(k), 0, kThetaSize, x.theta[k].data());
      if (chain_.bounded_) ClampToBounds(&x.theta[k]);
    }
    for (const Border& border : chain_.border_) {
      const auto& [data, size, column] = border.block;
      const std::size_t section = border.local ? border.section : x.theta.size() - 1;
      move(chain_.BlockOfSection(section), column - Normal::kSharedAt, size, data);
    }
    chain_.Refresh(false);
    return chain_.Cost();
  }

  bool IsSmall(double tolerance) const {
    return std::sqrt(step_) <= tolerance * (std::sqrt(norm_) + tolerance);
  }
  void Return() { chain_.x_ = start_; }
  void Keep() { best_ = chain_.x_; }
  void Restore() { chain_.x_ = best_; }

 private:
  void ClampToBounds(ThetaVector* theta) const {
    for (int i = 0; i < kMotionSize; ++i) {
      const auto [lower, upper] = chain_.ScaledBounds(i);
      (*theta)[i] = std::clamp((*theta)[i], lower, upper);
    }
  }

  SegmentChain& chain_;
  Unknowns start_, best_;
  double step_ = 0.0, norm_ = 0.0;  // squared, before the bounds
};

ceres::Solver::Summary SegmentChain::Solve(const TrustRegionOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  Minimiser minimiser(this);
  const TrustRegionResult result = MinimiseInTrustRegion(&minimiser, options);
  Refresh(false);
  ceres::Solver::Summary summary;
  summary.iterations.resize(result.iterations + 1);
  summary.termination_type = result.converged ? ceres::CONVERGENCE : ceres::NO_CONVERGENCE;
  summary.final_cost = result.cost;
  summary.total_time_in_seconds = SecondsSince(began);
  return summary;
}

ceres::Solver::Summary SegmentChain::Solve(const ceres::Solver::Options& options) {
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem(), &summary);
  Refresh(true);
  return summary;
}

ceres::Problem& SegmentChain::problem() {
  if (problem_) return *problem_;
  ceres::Problem::Options options = ProblemOptions(this);
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_ = std::make_unique<ceres::Problem>(options);
  const auto add = [&](const Term& term) {
    std::vector<double*> blocks;
    for (int b = 0; b < term.count; ++b) blocks.push_back(term.blocks[b].data);
    problem_->AddResidualBlock(term.cost.get(), term.loss.get(), blocks);
  };
  for (const std::vector<Term>& terms : terms_) std::for_each(terms.begin(), terms.end(), add);
  std::for_each(theta_steps_.begin(), theta_steps_.end(), add);
  for (ThetaVector& theta : x_.theta) {
    if (theta_held_) problem_->SetParameterBlockConstant(theta.data());
    for (int i = 0; bounded_ && i < kMotionSize; ++i) {
      const auto [lower, upper] = ScaledBounds(i);
      problem_->SetParameterLowerBound(theta.data(), i, lower);
      problem_->SetParameterUpperBound(theta.data(), i, upper);
    }
  }
  if (drift_held_) {
    problem_->SetManifold(x_.nodes[0].data(), new ceres::SubsetManifold(kGustAt, {0, 1, 2}));
  }
  return *problem_;
}

}  // namespace trueline
