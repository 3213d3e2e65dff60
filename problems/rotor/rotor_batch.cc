#include "problems/rotor/rotor_batch.h"

#include <glog/logging.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "cost_functions/models/rigid_body.h"
#include "problems/chain/damped_gauss_newton.h"
#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/common/units.h"
#include "problems/rotor/rotor_normal.h"

namespace trueline {
namespace {

// Shares of the inertia's trace. A second moment of mass below kFlat counts as zero; a zero moment
// that is freed starts at kThick.
constexpr double kFlat = 2e-6;
constexpr double kThick = 1e-2;

void CheckPrior(const RotorPrior& prior, const RotorData& data) {
  if (!data.motors && MotorsOf(prior.sigma).maxCoeff() > 0.0) {
    throw InputError(
        "motor_lag, motor_idle and motor_voltage can be fitted to motor commands only; set their "
        "prior to 0, or say how commands turn the motors by `motors`");
  }
  const int free =
      static_cast<int>((prior.sigma.segment<3>(kInertiaConstants).array() > 0.0).count());
  if (free != 0 && free != 3) {
    throw InputError("I_x, I_y and I_z are either all known (sigma 0) or all unknown");
  }
  if (!IsPhysicalInertia(prior.mean.segment<3>(kInertiaConstants)) ||
      !(prior.mean[kMassConstant] > 0.0)) {
    throw InputError(
        "the prior's mass or inertia is not that of a body: moments must be positive and each "
        "below the sum of the other two");
  }
}

// One solve, as a problem for MinimiseDamped: nodes, and the constants in their chart.
class Batch {
 public:
  Batch(const RotorAeroModel& model, const RotorData& data, const RotorBatchOptions& options)
      : model_(model), data_(data), options_(options), negligible_(options.negligible) {
    CheckPrior(options.prior, data);
    segments_ = MakeSegments(model, data, options);
    at_ = {ToChart(options.prior.mean), RoughNodes(data, options.prior.mean)};
  }

  RotorBatchResult Run() {
    RotorBatchResult result;
    for (int k = 0; k <= options_.reweights; ++k) {
      if (!SetWeights(FromChart(at_.chart))) {
        throw RunsAway();
      }
      negligible_ = k < options_.reweights ? kRough : options_.negligible;
      Solve(&result);
    }
    return Finished(std::move(result));
  }

  // Solves from `start`, a solution nearby, with weights evaluated there, or by `weights` if that
  // is not null. Where the model runs away from the flight, so that there are no weights, the cost
  // is infinite and the rest that of `start`.
  RotorBatchResult RunFrom(const RotorBatchResult& start, const RotorWeights* weights) {
    RotorBatchResult none = start;
    none.cost = std::numeric_limits<double>::infinity();
    at_ = {ToChart(options_.prior.WithKnown(start.mean)), start.nodes};
    if (weights != nullptr) {
      segments_ = WeighedSegments(model_, data_, options_, *weights);
      if (!HaveWeights(segments_)) return none;
    } else if (!SetWeights(FromChart(at_.chart))) {
      return none;
    }
    RotorBatchResult result;
    Solve(&result);
    return std::isfinite(result.cost) ? Finished(std::move(result)) : none;
  }

  // Evaluates weights and information at the given states.
  Eigen::MatrixXd BoundAt(const std::vector<RotorNode>& nodes, const RotorConstants& constants) {
    at_ = {ToChart(constants), nodes};
    CHECK(SetWeights(FromChart(at_.chart)));
    return Covariance(nullptr);
  }

  // Half the squares of all whitened residuals, poses under Huber's loss.
  double Cost() const {
    const RotorConstants constants = FromChart(at_.chart);
    std::vector<double> squares(at_.nodes.size());
    ParallelRuns(static_cast<int>(squares.size()), kSegmentsInARow,
                 [&](int i) { squares[i] = SquaresOf(i, constants); });
    const double prior = BorderPrior(options_.prior, constants, 0).error.squaredNorm() +
                         (at_.nodes.front().drift / options_.noise.DriftSigma()).squaredNorm();
    return 0.5 * std::accumulate(squares.begin(), squares.end(), prior);
  }

  double Linearise() {
    constexpr double kDescent = 0.5;  // least slope of a corrected step, of the proposed one's
    start_ = at_;
    HoldFlat();
    const BorderedChain<kNodeErrors> chain = Linear();
    const ReducedSystem::Prior prior = BorderPrior(options_.prior, FromChart(at_.chart), 0);
    const ReducedSystem reduced = chain.Reduced(prior);
    const std::vector<int> free = options_.prior.Free();
    // d(constants in prior sigmas) / d(their chart).
    const Eigen::MatrixXd by_chart =
        Eigen::VectorXd(options_.prior.sigma(free)).cwiseInverse().asDiagonal() *
        Eigen::MatrixXd(ChartJacobian(at_.chart)(free, free));
    const Eigen::MatrixXd M = by_chart.transpose() * reduced.M() * by_chart;
    const Eigen::VectorXd b = by_chart.transpose() * reduced.b();
    gradient_.setZero();
    gradient_(free) = b;
    const auto slope_to = [&](const ChainStep& step) {
      const Eigen::VectorXd border = by_chart * step.border;
      return chain.SlopeTo(step.nodes, border) + prior.error.dot(border);
    };
    step_ = {LimitedStep(M, b), {}};
    Eigen::VectorXd border(reduced.border() + 1);
    border << by_chart * step_.border, 1.0;
    step_.nodes = chain.NodesAt(border);
    const double slope = slope_to(step_);
    const std::optional<ChainStep> corrected = corrector_.Correct(M, step_);
    if (!corrected) return slope;
    const double of_corrected = slope_to(*corrected);
    if (of_corrected > kDescent * slope) return slope;
    corrector_.UseCorrected(*corrected);
    step_ = *corrected;
    return of_corrected;
  }

  bool Try(double part, double* cost) {
    RotorConstants step = RotorConstants::Zero();
    step(options_.prior.Free()) = part * step_.border;
    corrector_.SetPart(part);
    at_.chart = flat_.empty() ? MovedInChart(start_.chart, step) : start_.chart + step;
    for (std::size_t i = 0; i < at_.nodes.size(); ++i) {
      at_.nodes[i] = Plus(start_.nodes[i], RotorNodeError(part * step_.nodes[i]));
    }
    const RotorConstants constants = FromChart(at_.chart);
    if (!constants.allFinite()) return false;
    *cost = Cost();
    return true;
  }

  void Return() { at_ = start_; }

  bool IsSettled(double before, double after, double /*part*/) const {
    constexpr double kSettled = 1e-8;  // of the cost
    return before - after <= std::max(kSettled * before, negligible_);
  }

 private:
  static constexpr double kRough = 0.5;  // of the cost, before weights are evaluated again

  struct Point {
    RotorConstants chart;
    std::vector<RotorNode> nodes;
  };

  struct Weighed {
    RotorConstants constants;
    std::vector<RotorNode> nodes;
    BorderedChain<kNodeErrors> chain;
  };

  static bool IsSecondMoment(int constant) {
    return constant >= kInertiaConstants && constant < kInertiaConstants + 3;
  }

  // Of the rows of a node's pose and of the segment that it starts.
  double SquaresOf(int i, const RotorConstants& constants) const {
    const RotorState x = Joined(at_.nodes[i].motion, constants);
    double pose[6];
    const int rows = data_.attitude ? 6 : 3;
    ErrorOf(data_.poses[i], options_.noise)(x.data(), rows, pose);
    const double squares = options_.PoseCost(Eigen::Map<Eigen::VectorXd>(pose, rows).norm());
    if (i == static_cast<int>(segments_.size())) return squares;
    SegmentResidual step = segments_[i].Evaluate(at_.nodes[i], at_.nodes[i + 1], constants, false);
    segments_[i].Whiten(&step);
    return squares + step.error.squaredNorm();
  }

  RotorBatchResult Finished(RotorBatchResult result) {
    result.mean = FromChart(at_.chart);
    result.nodes = at_.nodes;
    if (!options_.covariance) return result;
    result.cov = Covariance(&result.log_evidence);
    result.noise_sigma = result.Sigma();
    result.log_evidence -= result.cost;
    return result;
  }

  // The step in the free constants' chart. A second moment near zero moves no reading, so its
  // logarithm is not determined: its step is limited, and the others are the best beside it.
  Eigen::VectorXd LimitedStep(const Eigen::MatrixXd& M, const Eigen::VectorXd& b) const {
    constexpr double kMost = 2.0;  // e-folds
    const std::vector<int> free = options_.prior.Free();
    Eigen::VectorXd most(b.size());
    for (int i = 0; i < static_cast<int>(free.size()); ++i) {
      const bool flat = flat_.count(free[i]) > 0;
      most[i] = flat ? 0.0 : IsSecondMoment(free[i]) ? kMost : INFINITY;
    }
    return BoundedStep(M, b, -most, most);
  }

  // Holds second moments that are zero (a flat body): no reading determines their logarithm.
  void HoldFlat() {
    if (!(options_.prior.sigma[kInertiaConstants] > 0.0)) return;
    const double trace = FromChart(at_.chart).segment<3>(kInertiaConstants).sum();
    for (int i = kInertiaConstants; i < kInertiaConstants + 3; ++i) {
      if (std::exp(at_.chart[i]) < kFlat * trace) flat_.insert(i);
    }
  }

  // Frees each held moment whose gradient points to growth and starts it at kThick. True if any.
  bool FreeFlat() {
    if (flat_.empty() || freed_) return false;
    Linearise();
    freed_ = true;  // once: the moment may end at zero again
    const double trace = FromChart(at_.chart).segment<3>(kInertiaConstants).sum();
    return std::erase_if(flat_, [&](int i) {
             if (gradient_[i] < 0.0) at_.chart[i] = std::log(kThick * trace);
             return gradient_[i] < 0.0;
           }) > 0;
  }

  // False if the model runs away from the flight.
  bool SetWeights(const RotorConstants& constants) {
    weighed_ =
        Weighed{constants, at_.nodes,
                WeighedChain(data_, options_, &segments_, at_.nodes, constants, {}, INFINITY)};
    return HaveWeights(segments_);
  }

  void Solve(RotorBatchResult* result) {
    const auto began = std::chrono::steady_clock::now();
    flat_.clear();
    freed_ = false;
    do {
      corrector_.Reset();
      const DampedResult solved = MinimiseDamped(this, options_.max_iterations);
      result->converged = solved.converged;
      result->iterations += solved.iterations;
      result->cost = solved.cost;
    } while (FreeFlat());
    result->residuals = static_cast<int>(options_.prior.Free().size()) + 3;  // priors
    for (const SegmentModel& segment : segments_) result->residuals += segment.segment().NumRows();
    result->residuals += (data_.attitude ? 6 : 3) * static_cast<int>(at_.nodes.size());
    result->solve_time += SecondsSince(began);
  }

  // The first linearisation is often where the weights were evaluated, whose chain is then used.
  BorderedChain<kNodeErrors> Linear() {
    const RotorConstants constants = FromChart(at_.chart);
    std::optional<Weighed> weighed = std::exchange(weighed_, std::nullopt);
    return weighed && weighed->constants == constants && weighed->nodes == at_.nodes
               ? std::move(weighed->chain)
               : LinearChain(data_, options_, segments_, at_.nodes, constants, {}, INFINITY);
  }

  // Covariance of the constants, and the determinants' part of the log evidence where asked for.
  Eigen::MatrixXd Covariance(double* log_evidence) {
    const BorderedChain<kNodeErrors> chain = Linear();
    CHECK(chain.regular()) << "a pose does not determine its node";
    const ReducedSystem reduced =
        chain.Reduced(BorderPrior(options_.prior, FromChart(at_.chart), 0));
    if (log_evidence != nullptr) *log_evidence = reduced.LogDeterminants(reduced.border());
    return InUnits(options_.prior, reduced.Covariance());
  }

  const RotorAeroModel& model_;
  const RotorData& data_;
  const RotorBatchOptions& options_;
  std::vector<SegmentModel> segments_;
  std::optional<Weighed> weighed_;  // the chain where the weights were evaluated
  Point at_, start_;                // start: of the step
  ChainStep step_;                  // its border: the free constants' chart
  StepCorrector corrector_;
  RotorConstants gradient_;  // of the cost by the chart, nodes at their best
  std::set<int> flat_;       // held second moments of the chart
  bool freed_ = false;
  double negligible_;  // of the cost
};

// Rotor speeds from commands are linearised in the motors' unknowns at the values that `data`
// holds. This function relinearises until the linearisation point is the solution. It re-evaluates
// the weights at each point too, unless `start` is given: then those of `weights` or of the start
// are kept. Until the point has converged a few iterations of each solve are enough.
RotorBatchResult SolveTurningMotors(const RotorAeroModel& model, RotorData* data,
                                    const RotorBatchOptions& options, const RotorBatchResult* start,
                                    const RotorWeights* weights) {
  constexpr int kMostTurns = 20;
  constexpr int kFew = 4;           // iterations
  constexpr double kSettled = 0.1;  // sigmas
  RotorBatchOptions fine = options, rough = options;
  fine.covariance = rough.covariance = true;
  rough.max_iterations = std::min(kFew, options.max_iterations);
  RotorBatchResult result = start != nullptr ? *start : Batch(model, *data, fine).Run();
  if (start != nullptr) result.iterations = 0, result.solve_time = 0.0;
  RotorConstants at = result.mean;
  FixedPoint fixed_point;
  bool settled = false;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    data->SimulateMotors(MotorsOf(at));
    const RotorBatchResult before = std::move(result);
    Batch batch(model, *data, settled || turn + 1 == kMostTurns ? fine : rough);
    RotorBatchResult point = before;
    point.mean = at;
    const RotorWeights own{model, *data, start != nullptr ? *start : point};
    result = batch.RunFrom(before, weights != nullptr ? weights : &own);
    if (!std::isfinite(result.cost) && start == nullptr) throw RunsAway();
    if (!std::isfinite(result.cost)) return result;
    result.iterations += before.iterations;
    result.solve_time += before.solve_time;
    RotorConstants sigma = result.Sigma();
    if (start != nullptr) sigma.head<RotorAeroModel::kMotors - RotorAeroModel::kMoving>().setZero();
    const RotorConstants moved = (result.mean - at).cwiseAbs();
    settled = (sigma.array() == 0.0 || moved.array() <= kSettled * sigma.array()).all();
    if (settled && result.converged) break;
    if (settled) continue;
    const RotorConstants next = fixed_point.Next(at, result.mean, sigma);
    const bool exists = next[kMassConstant] > 0.0 && next.segment<3>(kInertiaConstants).sum() > 0.0;
    at = exists ? next : result.mean;  // the mixed value may have no mass or inertia
  }
  return result;
}

}  // namespace

InputError RunsAway() {
  return InputError(
      "the rotor-driven model diverges from the flight within a few samples; check mass, inertia "
      "and rotors of the configuration, and the log by trueline inspect");
}

RotorBatchResult RunRotorBatch(const RotorAeroModel& model, const RotorData& flown,
                               const RotorBatchOptions& options, const RotorBatchResult* start,
                               const RotorWeights* weights) {
  RotorData turned;
  const bool turns = MotorsOf(options.prior.sigma).maxCoeff() > 0.0;
  if (turns && flown.motors) turned = flown;
  const RotorData& data = turned.motors ? turned : flown;
  RotorBatchResult result =
      turned.motors      ? SolveTurningMotors(model, &turned, options, start, weights)
      : start != nullptr ? Batch(model, data, options).RunFrom(*start, weights)
                         : Batch(model, data, options).Run();
  if (!options.widen || !options.covariance || !std::isfinite(result.cost)) return result;
  result.Widen(WideningFactors(model, data, options, result));
  return result;
}

Eigen::MatrixXd RotorBound(const RotorAeroModel& model, const RotorData& data,
                           const RotorBatchOptions& options, const std::vector<RotorNode>& nodes,
                           const RotorConstants& constants) {
  return Batch(model, data, options).BoundAt(nodes, constants);
}

namespace {

constexpr int kAgain = 3;  // what is lost of fast changes then biases inertia less than its sigma
constexpr int kPairs = 2;

Eigen::MatrixXd Drawn(const MeasuredSpeeds& measured, Random* random) {
  Eigen::MatrixXd noise(measured.speeds.rows(), measured.speeds.cols());
  for (double& value : noise.reshaped()) value = measured.model.sigma * random->Normal();
  return noise;
}

bool IsBody(const RotorConstants& constants) {
  return constants[kMassConstant] > 0.0 &&
         IsPhysicalInertia(constants.segment<3>(kInertiaConstants));
}

}  // namespace

RotorBatchResult WithoutSpeedNoiseBias(const RotorAeroModel& model, const RotorData& data,
                                       const RotorBatchOptions& options,
                                       const RotorBatchResult& batch, RotorConstants* bias) {
  const MeasuredSpeeds& measured = data.measured;
  if (bias != nullptr) bias->setZero();
  if (measured.model.sigma == 0.0) return batch;
  RotorData trial = data;
  const auto fit = [&](const Eigen::MatrixXd& speeds, const RotorBatchOptions& how,
                       const RotorBatchResult& start) {
    trial.SetSpeeds(SmoothSpeeds(data.speed_times, speeds, measured.model, kAgain));
    return RunRotorBatch(model, trial, how, &start);
  };
  RotorBatchResult corrected = fit(measured.speeds, options, batch);
  RotorBatchOptions mean_only = options;
  mean_only.covariance = false;
  Random random(1, "speed noise");
  RotorConstants moved = RotorConstants::Zero();
  bool fits = std::isfinite(corrected.cost);
  for (int pair = 0; pair < kPairs && fits; ++pair) {
    const Eigen::MatrixXd noise = Drawn(measured, &random);
    for (const double sign : {-1.0, 1.0}) {
      const RotorBatchResult noisier = fit(measured.speeds + sign * noise, mean_only, corrected);
      fits = fits && std::isfinite(noisier.cost);
      moved += (noisier.mean - corrected.mean) / (2.0 * kPairs);
    }
  }
  corrected.mean -= moved;
  if (!fits || !IsBody(corrected.mean)) return batch;
  if (bias != nullptr) *bias = moved;
  return corrected;
}

}  // namespace trueline
