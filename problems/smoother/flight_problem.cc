#include "problems/smoother/flight_problem.h"

#include <ceres/normal_prior.h>

#include <algorithm>
#include <cmath>

#include "cost_functions/continuity_residual.h"
#include "cost_functions/drag_residual.h"
#include "cost_functions/offset_fix_residual.h"
#include "cost_functions/parameter_step_residual.h"
#include "problems/common/ceres_problem.h"
#include "problems/vgd/fix_loss.h"
#include "problems/vgd/make_segment.h"
#include "problems/vgd/vgd.h"
#include "problems/window/rough_path.h"

namespace trueline {
namespace {

// The airframe's parameters may change by this share of their prior sigma from section to section.
// This nearly rigid tie keeps the chain banded; the share is far below any flight's resolution.
constexpr double kTie = 1e-4;
constexpr double kHeld = 1e4;  // in each section, times the weight of the prior

template <class Vector>
ceres::CostFunction* Prior(const Vector& weight) {
  return new ceres::NormalPrior(Eigen::MatrixXd(weight.asDiagonal()),
                                Eigen::VectorXd::Zero(weight.size()));
}

}  // namespace

FlightProblem::FlightProblem(const std::vector<FlightShare>& flights,
                             const FlightProblemOptions& options)
    : flights_(flights), options_(options), scaling_(options.vgd), problem_(ProblemOptions(this)) {
  BuildSections();
  AllocateUnknowns();
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    if (k == 0 || sections_[k].flight != sections_[k - 1].flight) AddFlightPriors(k);
    HoldDrag(k);
    if (k > 0) AddStep(k);
    AddMeasurements(k);
    AddContinuity(k);
  }
}

void FlightProblem::BuildSections() {
  for (std::size_t f = 0; f < flights_.size(); ++f) {
    const FlightData& flight = *flights_[f].flight;
    const int count = std::min(static_cast<int>(flight.passes.size()), flights_[f].passes);
    for (int k = 0; k < count; ++k) {
      const WindowData data = CutWindow(flight, options_.vgd, k, k + 1, k + 1 < count);
      const bool continues = k > 0 && flight.HasArc(k);
      sections_.push_back({static_cast<int>(f), data.begin, data.end, segments_.size(), continues});
      passes_.push_back(k);
      const auto knots = EvenKnots(data.begin, data.end, options_.vgd.knot_interval);
      for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
        segments_.push_back(MakeSegment(flight.track, data, knots[i], knots[i + 1], scaling_,
                                        options_.vgd.max_block));
        segments_.back()->FollowDerivatives();
        section_of_.push_back(sections_.size() - 1);
      }
    }
  }
}

std::size_t FlightProblem::EndOf(std::size_t section) const {
  return section + 1 < sections_.size() ? sections_[section + 1].first_segment : segments_.size();
}

void FlightProblem::AllocateUnknowns() {
  x_.theta.assign(sections_.size(), Eigen::Matrix<double, kThetaSize, 1>::Zero());
  x_.drift.assign(segments_.size(), Eigen::Vector3d::Zero());
  x_.states.assign(segments_.size(), Eigen::Matrix<double, 6, 1>::Zero());
  for (auto& theta : x_.theta) {
    problem_.AddParameterBlock(theta.data(), kThetaSize);
    for (int i = 0; i < kMotionSize; ++i) {
      const ParameterPrior& prior = options_.vgd.priors[i];
      problem_.SetParameterLowerBound(theta.data(), i, (prior.lower - prior.mean) / prior.sigma);
      problem_.SetParameterUpperBound(theta.data(), i, (prior.upper - prior.mean) / prior.sigma);
    }
  }
  AllocateGusts();
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    if (flights_[sections_[k].flight].false_passes.count(passes_[k]) == 0) continue;
    offsets_[k].setZero();
  }
  const FalsePassOptions& wrong = options_.walks.false_pass;
  Eigen::Matrix<double, 6, 1> weight;
  weight << Eigen::Vector3d::Constant(1.0 / wrong.offset),
      Eigen::Vector3d::Constant(1.0 / wrong.offset_rate);
  for (auto& [section, offset] : offsets_) {
    problem_.AddResidualBlock(Prior(weight), nullptr, offset.data());
  }
  if (!options_.detector.Any()) return;
  problem_.AddResidualBlock(Prior(Eigen::Matrix<double, kMountSize, 1>::Ones()), nullptr,
                            mount_.data());
  for (const FlightShare& share : flights_) {
    for (const Gate& gate : share.flight->log.gates) gates_[gate.id].setZero();
  }
  for (auto& [id, offset] : gates_) {
    problem_.AddResidualBlock(Prior(Eigen::Vector3d::Ones()), nullptr, offset.data());
  }
}

void FlightProblem::AllocateGusts() {
  if (!options_.vgd.UsesGusts()) return;
  x_.gusts.assign(segments_.size(), Eigen::Vector2d::Zero());
  std::vector<bool> linked(segments_.size(), true);
  for (std::size_t k = 0; k < sections_.size(); ++k) {
    if (k + 1 == sections_.size() || !sections_[k + 1].continues) linked[EndOf(k) - 1] = false;
  }
  gusts_ = GustBlocks(options_.vgd.process, std::move(linked), &x_.gusts, &problem_);
}

// The first flight gets the full prior. A later one gets none on the airframe, whose parameters are
// tied to the flight before.
void FlightProblem::AddFlightPriors(std::size_t section) {
  Eigen::Matrix<double, kThetaSize, 1> weight = Eigen::Matrix<double, kThetaSize, 1>::Ones();
  for (int i = 0; i < kThetaSize; ++i) {
    if (section > 0 && IsAirframe(i)) weight[i] = 0.0;
  }
  problem_.AddResidualBlock(Prior(weight), nullptr, x_.theta[section].data());
}

// Holds drag in every section, so that a long flight's many sections do not outweigh the prior.
void FlightProblem::HoldDrag(std::size_t section) {
  Eigen::Matrix<double, kThetaSize, 1> weight = Eigen::Matrix<double, kThetaSize, 1>::Zero();
  for (const int i : {0, 1}) {
    if (!options_.drag_shows[i]) weight[kDragInTheta + i] = kHeld;
  }
  if (weight.isZero()) return;
  problem_.AddResidualBlock(Prior(weight), nullptr, x_.theta[section].data());
}

void FlightProblem::AddStep(std::size_t section) {
  const Section &last = sections_[section - 1], &next = sections_[section];
  Eigen::Matrix<double, kThetaSize, 1> sigma = Eigen::Matrix<double, kThetaSize, 1>::Zero();
  if (last.flight == next.flight) {
    const double root = std::sqrt(SecondsBetween(last.begin, next.begin));
    for (int i = 0; i < kThetaSize; ++i) sigma[i] = options_.walks.WalkOf(kTheta[i].group) * root;
    sigma = sigma.cwiseQuotient(scaling_.sigma).cwiseMax(kTie);
  } else {
    sigma.setConstant(std::numeric_limits<double>::infinity());
  }
  for (int i = 0; i < kThetaSize; ++i) {
    if (IsAirframe(i)) sigma[i] = kTie;
  }
  problem_.AddResidualBlock(new ParameterStepResidual(sigma.cwiseInverse()), nullptr,
                            x_.theta[section - 1].data(), x_.theta[section].data());
}

std::vector<double*> FlightProblem::Blocks(std::size_t segment) {
  return {x_.theta[section_of_[segment]].data(), x_.drift[segment].data(),
          x_.states[segment].data()};
}

std::size_t FlightProblem::SegmentAt(std::size_t section, TimeNs t) const {
  std::size_t s = sections_[section].first_segment;
  while (s + 1 < EndOf(section) && segments_[s + 1]->start() <= t) ++s;
  return s;
}

void FlightProblem::AddFix(const Fix& fix, std::size_t segment, const FlightShare& share,
                           double* offset, TimeNs pass_begin) {
  const StateNode* node = segments_[segment]->StateAt(fix.t);
  std::vector<double*> blocks = Blocks(segment);
  const auto& gates = share.flight->log.gates;
  const auto gate = std::find_if(gates.begin(), gates.end(),
                                 [&](const Gate& candidate) { return candidate.id == fix.gate; });
  ceres::CostFunction* residual = nullptr;
  if (offset != nullptr) {
    residual = new OffsetFixResidual(node, fix.p_E, fix.sigma, SecondsBetween(pass_begin, fix.t));
    blocks.push_back(offset);
  } else if (options_.detector.Any() && gate != gates.end()) {
    const DriveTrack& track = share.flight->track;
    MountedFix mounted{
        fix.p_E,
        fix.sigma,
        gate->position - fix.p_E,
        track.steps()[track.StepAt(fix.t)].drive.R_Ep_I,
        Eigen::Matrix<double, kMountSize, 1>::Constant(options_.detector.camera_misalignment),
        options_.detector.gate_offset};
    mounted.mount[0] = options_.detector.fix_latency;
    residual = new MountedFixResidual(node, mounted);
    blocks.insert(blocks.end(), {mount_.data(), gates_.at(fix.gate).data()});
  } else {
    residual = new FixResidual(node, fix.p_E, fix.sigma);
  }
  // The effect of camera misalignment or latency on this residual is of second order and left out.
  gusts_.Add(&problem_, residual, MakeLoss(options_.vgd.loss, options_.vgd.loss_scale), blocks,
             segment, segments_[segment]->StateGustsAt(fix.t).topRows<3>() / fix.sigma);
}

void FlightProblem::AddMeasurements(std::size_t section) {
  const FlightShare& share = flights_[sections_[section].flight];
  const int pass = passes_[section];
  const bool with_arc = segments_[EndOf(section) - 1]->end() > share.flight->passes[pass].end;
  const WindowData data = CutWindow(*share.flight, options_.vgd, pass, pass + 1, with_arc);
  const auto offset = offsets_.find(section);
  double* own = offset == offsets_.end() ? nullptr : offset->second.data();
  for (const Fix& fix : data.fixes) {
    AddFix(fix, SegmentAt(section, fix.t), share, own, data.begin);
  }
  for (const ForceSample& force : data.forces) {
    const std::size_t s = SegmentAt(section, force.t);
    has_forces_ = true;
    gusts_.Add(&problem_,
               new DragResidual(segments_[s]->ForceAt(force.t), force.accel_xy, data.force_sigma),
               new ceres::HuberLoss(2.5), Blocks(s), s,
               segments_[s]->ForceGustsAt(force.t) / data.force_sigma);
  }
}

void FlightProblem::AddContinuity(std::size_t section) {
  const ProcessNoise& process = options_.vgd.process;
  const double gravity = flights_[sections_[section].flight].flight->track.gravity();
  for (std::size_t s = sections_[section].first_segment; s < EndOf(section); ++s) {
    if (s == sections_[section].first_segment && !sections_[section].continues) {
      const Eigen::Vector3d sigma = process.DriftSigma().cwiseMax(1e-5);
      log_weights_ -= sigma.array().log().sum();
      problem_.AddResidualBlock(Prior(scaling_.DriftUnit().cwiseQuotient(sigma)), nullptr,
                                x_.drift[s].data());
      if (gusts_.Any()) gusts_.AddPrior(&problem_, s, &log_weights_);
      continue;
    }
    const Segment& last = *segments_[s - 1];
    const double seconds = SecondsBetween(last.start(), last.end());
    const Matrix9d weight = StepSqrtInformation(process, seconds, gravity);
    log_weights_ += weight.diagonal().array().log().sum();
    std::vector<double*> blocks = Blocks(s - 1);
    blocks.insert(blocks.end(), {x_.drift[s].data(), x_.states[s].data()});
    gusts_.Add(&problem_,
               new ContinuityResidual(last.end_node(), scaling_.DriftUnit(), process.Decay(seconds),
                                      weight),
               nullptr, blocks, s - 1, -weight.leftCols<6>() * StateByGusts(seconds, seconds));
    if (gusts_.Any()) gusts_.AddStep(&problem_, s - 1, seconds, &log_weights_);
  }
}

void FlightProblem::SetStart() {
  for (std::size_t k = 0; k < sections_.size();) {
    std::size_t end = k + 1;
    while (end < sections_.size() && sections_[end].continues) ++end;
    const FlightShare& share = flights_[sections_[k].flight];
    std::vector<Pass> trusted;
    for (std::size_t i = k; i < end; ++i) {
      if (offsets_.count(i) == 0) trusted.push_back(share.flight->passes[passes_[i]]);
    }
    if (trusted.empty()) trusted.push_back(share.flight->passes[passes_[k]]);
    const RoughPath path(share.flight->log.fixes, trusted);
    for (std::size_t s = sections_[k].first_segment; s < EndOf(end - 1); ++s) {
      const LineFit guess = path.At(segments_[s]->start());
      x_.states[s] << guess.p, guess.v;
    }
    k = end;
  }
}

void FlightProblem::StartFrom(const FlightProblem& other) {
  x_ = other.x_;
  mount_ = other.mount_;
  for (auto& [id, offset] : gates_) offset = other.gates_.at(id);  // in place: blocks point there
  for (auto& [section, offset] : offsets_) offset = other.offsets_.at(section);
}

void FlightProblem::PrepareForEvaluation(bool evaluate_jacobians, bool /*new_evaluation_point*/) {
  Refresh(evaluate_jacobians);
}

void FlightProblem::Refresh(bool derivatives) {
  if (x_ == integrated_ && (has_derivatives_ || !derivatives)) return;
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    segments_[s]->Evaluate(x_.theta[section_of_[s]].data(), x_.drift[s].data(), x_.states[s].data(),
                           derivatives);
    if (gusts_.Any()) segments_[s]->AddGusts(gusts_.At(s));
  }
  integrated_ = x_;
  has_derivatives_ = derivatives;
}

ceres::Solver::Summary FlightProblem::Solve() {
  ceres::Solver::Options options;
  options.max_num_iterations = options_.vgd.max_iterations;
  options.function_tolerance = options_.vgd.tolerance;
  options.max_num_line_search_step_size_iterations = 0;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Levenberg-Marquardt damping is proportional to the Hessian's diagonal, which the stiff ties
  // dominate; it would hold the airframe's parameters. Start with nearly undamped Gauss-Newton
  // steps.
  options.initial_trust_region_radius = 1e12;
  options.max_trust_region_radius = 1e16;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  Refresh(true);
  return summary;
}

std::vector<int> FlightProblem::GateIds() const {
  std::vector<int> ids;
  for (const auto& [id, offset] : gates_) ids.push_back(id);
  return ids;
}

std::vector<TrajectoryPoint> FlightProblem::Trajectory() const {
  std::vector<TrajectoryPoint> points;
  for (const auto& segment : segments_) {
    for (const TimeNs t : segment->times()) {
      const auto& x = segment->StateAt(t)->value;
      points.push_back({t, x.head<3>(), x.tail<3>()});
    }
  }
  return points;
}

}  // namespace trueline
