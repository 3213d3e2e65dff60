#include "problems/smoother/smoother.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <optional>
#include <set>

#include "problems/common/error.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_estimate.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

Eigen::MatrixXd CovarianceOf(const WindowPrior& prior) {
  const Eigen::MatrixXd information = prior.sqrt_information.transpose() * prior.sqrt_information;
  return information.ldlt().solve(
      Eigen::MatrixXd::Identity(information.rows(), information.cols()));
}

void SetCovariance(const Eigen::MatrixXd& cov, WindowPrior* prior) {
  const Eigen::MatrixXd L = cov.llt().matrixL();
  prior->sqrt_information =
      L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(cov.rows(), cov.cols()));
}

// Adds the random walk of the shared parameters over `seconds` to their covariance.
void AddRandomWalk(const SmootherOptions& options, const ParameterScaling& scaling, double seconds,
                   WindowPrior* prior) {
  Eigen::Matrix<double, kThetaSize, 1> walk = Eigen::Matrix<double, kThetaSize, 1>::Zero();
  for (int i = 0; i < kThetaSize; ++i) walk[i] = options.WalkOf(kTheta[i].group);
  if (walk.isZero()) return;
  Eigen::MatrixXd cov = CovarianceOf(*prior);
  cov.diagonal().head<kThetaSize>() += walk.cwiseQuotient(scaling.sigma).cwiseAbs2() * seconds;
  SetCovariance(cov, prior);
}

// After a break: theta keeps its posterior, drift and gust return to their priors, the state is
// unknown.
WindowPrior KeepParameters(const WindowPrior& past, const VgdOptions& vgd, const LineFit& start) {
  constexpr double kOpen = 100.0;  // m and m/s, sigma of an unknown state
  WindowPrior prior;
  const Eigen::Index size = past.mean.size();
  prior.mean = Eigen::VectorXd::Zero(size);
  prior.mean.head<WindowPrior::kSize>() << past.mean.head<kThetaSize>(), Eigen::Vector3d::Zero(),
      start.p, start.v;
  prior.drag_errors = past.drag_errors;
  Eigen::MatrixXd cov = Eigen::MatrixXd::Zero(size, size);
  cov.topLeftCorner<kThetaSize, kThetaSize>() =
      CovarianceOf(past).topLeftCorner<kThetaSize, kThetaSize>();
  const Eigen::Vector3d drift =
      vgd.process.StartSigma().cwiseQuotient(ParameterScaling(vgd).DriftUnit());
  cov.diagonal().segment<kDriftSize>(kThetaSize) = drift.cwiseAbs2();
  cov.diagonal().segment<kStateSize>(kThetaSize + kDriftSize).setConstant(kOpen * kOpen);
  const double gust_variance = vgd.process.gust * vgd.process.gust;
  cov.diagonal().tail(size - WindowPrior::kSize).setConstant(gust_variance);
  SetCovariance(cov, &prior);
  return prior;
}

// One hypothesis on which passes of a window are false, solved. Hypotheses are compared by
// evidence.
struct Hypothesis {
  std::set<int> false_passes;  // indices among the flight's
  bool lost = false;           // the path starts anew
  WindowData data;
  std::unique_ptr<WindowProblem> problem;
  ceres::Solver::Summary summary;
  double log_probability = 0.0;  // up to a constant that all hypotheses share
};

// The window on which hypotheses are compared: passes first ... tau - 1 of the flight.
struct WindowQuestion {
  const FlightData& flight;
  const VgdOptions& vgd;
  const FalsePassOptions& options;
  Theta start;
  int first;
  int tau;
  std::optional<WindowPrior> past;
  std::optional<WindowPrior> past_if_lost;  // empty: `lost` is not tested
};

// If the newest pass fits a marginalised past with log odds above this, no alternative is tested.
constexpr double kClear = 3.0;

// The passes that are not false (all, if every one is), for the start of the search.
std::vector<Pass> TrustedPasses(const WindowQuestion& question, const std::set<int>& false_passes) {
  const auto& all = question.flight.passes;
  std::vector<Pass> passes;
  for (int k = question.first; k < question.tau; ++k) {
    if (false_passes.count(k) == 0) passes.push_back(all[k]);
  }
  if (passes.empty()) passes.assign(all.begin() + question.first, all.begin() + question.tau);
  return passes;
}

// Without a past, at least one pass must be true: nothing else determines the position.
bool IsPossible(const WindowQuestion& question, const std::set<int>& false_passes, bool lost) {
  const bool all_false = static_cast<int>(false_passes.size()) == question.tau - question.first;
  return !all_false || (question.past && !lost);
}

std::set<int> Flipped(std::set<int> passes, int k) {
  if (passes.erase(k) == 0) passes.insert(k);
  return passes;
}

// Solves the window under one hypothesis.
Hypothesis SolveUnder(const WindowQuestion& question, const std::set<int>& false_passes,
                      bool lost) {
  const FalsePassOptions& options = question.options;
  Hypothesis hypothesis{false_passes, lost, {}, nullptr, {}, 0.0};
  hypothesis.data = CutWindow(question.flight, question.vgd, question.first, question.tau, true);
  for (const int k : false_passes) {
    hypothesis.data.offsets.push_back(
        {k - question.first, FalsePassOptions::kOffset, FalsePassOptions::kOffsetRate});
  }
  hypothesis.problem =
      std::make_unique<WindowProblem>(question.flight.track, hypothesis.data, question.vgd,
                                      lost ? question.past_if_lost : question.past);
  const std::vector<Pass> trusted = TrustedPasses(question, false_passes);
  hypothesis.problem->SetStart(question.start, RoughPath(question.flight.log.fixes, trusted));
  hypothesis.summary = hypothesis.problem->Solve();
  if (options.probability <= 0.0) return hypothesis;
  const double odds = std::log(options.probability / (1.0 - options.probability));
  hypothesis.log_probability = hypothesis.problem->LogEvidence() +
                               odds * static_cast<double>(false_passes.size()) +
                               (lost ? std::log(FalsePassOptions::kLost) : 0.0);
  return hypothesis;
}

// Replaces `best` by the most probable hypothesis that differs from it in one pass or in `lost`.
// True if any is better.
bool Improve(const WindowQuestion& question, Hypothesis* best) {
  const std::set<int> from = best->false_passes;
  const bool lost = best->lost;
  bool improved = false;
  const auto attempt = [&](const std::set<int>& passes, bool is_lost) {
    if (!IsPossible(question, passes, is_lost)) return;
    Hypothesis other = SolveUnder(question, passes, is_lost);
    if (!(other.log_probability > best->log_probability)) return;
    *best = std::move(other);
    improved = true;
  };
  for (int k = question.first; k < question.tau; ++k) attempt(Flipped(from, k), lost);
  if (!lost && question.past_if_lost) attempt({}, true);
  return improved;
}

// The most probable hypothesis, found by flipping one pass at a time from `last` (the decision on
// the window before). If the newest pass agrees with a marginalised past, no alternative is tested.
Hypothesis MostProbable(const WindowQuestion& question, const std::set<int>& last) {
  Hypothesis best = SolveUnder(question, last, false);
  if (question.options.probability <= 0.0) return best;
  const std::set<int> flipped = Flipped(last, question.tau - 1);
  if (IsPossible(question, flipped, false)) {
    const Hypothesis other = SolveUnder(question, flipped, false);
    const bool agrees = best.log_probability > other.log_probability + kClear;
    if (agrees && last.empty() && question.past) return best;
  }
  while (Improve(question, &best)) {
  }
  return best;
}

// The smoother's state between two windows: the window's start and the marginalised past.
class FixedLag {
 public:
  FixedLag(const FlightData& flight, const VgdOptions& vgd, const SmootherOptions& options)
      : flight_(flight), vgd_(vgd), options_(options), start_(PriorMeans(vgd)) {
    if (flight.continuous) options_.false_pass.probability = 0.0;  // no gates, no false ones
  }

  WindowEstimate Advance(int tau, const ProcessNoise& process) {
    vgd_.process = process;
    WindowQuestion question{flight_, vgd_, options_.false_pass, start_, first_, tau, past_, {}};
    if (past_) {
      const Pass& first = flight_.passes[first_];
      question.past_if_lost = KeepParameters(*past_, vgd_, LineAt(first));
    }
    const Hypothesis best = MostProbable(question, false_);
    false_ = best.false_passes;
    if (best.lost) past_ = question.past_if_lost;
    WindowProblem* problem = best.problem.get();
    WindowEstimate estimate = DescribeWindow(flight_, vgd_, best.data, tau, best.summary, problem);
    if (estimate.converged) start_ = ThetaOf(estimate);
    if (!flight_.HasArc(tau)) {
      Break(tau, problem);
    } else if (tau - first_ >= vgd_.gamma) {
      DropFirstPass(problem);
    }
    return estimate;
  }

  // Passes judged false when they left the window, and those judged false now.
  std::vector<int> FalsePasses() const {
    std::vector<int> passes = dropped_false_;
    passes.insert(passes.end(), false_.begin(), false_.end());
    return passes;
  }

 private:
  LineFit LineAt(const Pass& pass) const {
    return FitLine(flight_.log.fixes, pass.first, pass.last, pass.begin);
  }

  void DropFirstPass(WindowProblem* problem) {
    const TimeNs from = flight_.passes[first_].begin, to = flight_.passes[first_ + 1].begin;
    // The data of the window's first pass end where the next pass begins, if the window has that
    // knot.
    if (first_ + 1 >= static_cast<int>(flight_.passes.size()) || !HasKnot(*problem, to)) return;
    past_ = problem->Marginalise(to);
    AddRandomWalk(options_, problem->scaling(), SecondsBetween(from, to), &*past_);
    if (false_.erase(first_) > 0) dropped_false_.push_back(first_);
    ++first_;
  }

  static bool HasKnot(const WindowProblem& problem, TimeNs t) {
    return problem.segments().back()->start() >= t;
  }

  // Marginalises up to the last knot and carries only the parameters over the break.
  void Break(int tau, WindowProblem* problem) {
    first_ = tau;
    dropped_false_.insert(dropped_false_.end(), false_.begin(), false_.end());
    false_.clear();
    if (tau >= static_cast<int>(flight_.passes.size()) || problem->segments().size() < 2) return;
    const WindowPrior last = problem->Marginalise(problem->segments().back()->start());
    const Pass& next = flight_.passes[tau];
    past_ = KeepParameters(last, vgd_, LineAt(next));
    AddRandomWalk(options_, problem->scaling(),
                  SecondsBetween(flight_.passes[tau - 1].end, next.begin), &*past_);
  }

  const FlightData& flight_;
  VgdOptions vgd_;
  SmootherOptions options_;
  Theta start_;
  int first_ = 0;  // index of the window's first pass
  std::optional<WindowPrior> past_;
  std::set<int> false_;             // passes of the window that look false
  std::vector<int> dropped_false_;  // false passes that left the window
};

}  // namespace

void Serialize(YamlArchive* a, SmootherOptions* o) {
  a->NotNegative("accel_bias_walk_mps2_per_sqrt_s", &o->accel_bias_walk);
  a->NotNegative("ahrs_error_walk_deg_per_sqrt_s", &o->ahrs_error_walk, kDegree);
  a->Map("false_pass", [pass = &o->false_pass](YamlArchive* map) {
    map->NotNegative("probability", &pass->probability);
    map->Require(pass->probability < 1.0, "probability", "must be below 1");
  });
}

EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options) {
  return RunSmoother(flight, vgd, options, LearnProcess(flight, vgd));
}

EstimatorRun RunSmoother(const FlightData& flight, const VgdOptions& vgd,
                         const SmootherOptions& options,
                         const std::vector<ProcessNoise>& processes) {
  if (!vgd.process.Any()) {
    throw InputError(
        "the smoother needs process noise: set a strength under 'process' in the configuration");
  }
  EstimatorRun run{"smoother", vgd.gamma, {}, flight.warnings};
  FixedLag lag(flight, vgd, options);
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    run.windows.push_back(lag.Advance(tau, processes[tau - 1]));
    const bool last = tau == static_cast<int>(flight.passes.size());
    if (!last && !run.windows.back().arc) run.warnings.push_back(flight.NoArcReason(tau));
  }
  run.false_passes = lag.FalsePasses();
  for (const int k : run.false_passes) {
    run.warnings.push_back(fmt::format(
        "pass {} (at {:.2f} s) looks false: its fixes fit neither the passes around it nor the "
        "model, and do not count",
        k + 1, SecondsBetween(flight.track.log_start(), flight.passes[k].begin)));
  }
  return run;
}

}  // namespace trueline
