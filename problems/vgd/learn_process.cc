#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/vgd/flight_data.h"
#include "problems/vgd/vgd.h"
#include "problems/vgd/window_problem.h"

namespace trueline {
namespace {

constexpr double kTiltFactors[] = {0.125, 0.25, 0.5, 1.0, 2.0, 4.0};  // of options.process.tilt
constexpr double kGustFactors[] = {0.25, 1.0, 2.0, 4.0, 8.0};         // of options.process.gust
constexpr double kThrustFactors[] = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0};  // of its thrust_factor
const double kPriorSpread = std::log(3.0);  // of the hypotheses' logarithms
constexpr double kMisfit = 2.0;  // mean square of whitened residuals that no drift explains
// One term of the evidence: three passes and the arcs between them (two at the flight's start). The
// next term begins with the last pass of this one, so every arc counts once.
constexpr int kPasses = 3, kStride = 2;
// A hypothesis whose log evidence is lower than the best by more than this is rejected.
constexpr double kOut = 10.0;

// Hypothesis that one of the passes is false: its prior probability, and the sigmas of its offset.
const double kLogFalse = std::log(0.1);
constexpr double kFalseOffset = 2.0;      // m
constexpr double kFalseOffsetRate = 0.2;  // m/s
// If a hypothesis's log evidence is lower than the best by more than this, a false pass is tested
// as the explanation.
constexpr double kInconsistent = 5.0;

double LogSum(double a, double b) {
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

double LogPrior(double factor) {
  const double z = std::log(factor) / kPriorSpread;
  return -0.5 * z * z;
}

// Empirical Bayes over a grid of hypotheses for the stationary sigmas of tilt and gust, and beside
// the most probable of these for the unmodelled acceleration along the thrust. The log
// evidence (marginal likelihood, by Laplace's approximation) of every arc between two passes is
// summed as the flight goes on, so a prediction uses past flight only. A fixed sigma would be too
// wide for some vehicles and too narrow for others, and so would the stated uncertainty. The
// evidence includes the hypothesis that one of the passes is false; its offset would otherwise be
// attributed to drift.
class ProcessLearner {
 public:
  // Without evidence the hypotheses' prior is centred on options.process.
  explicit ProcessLearner(const VgdOptions& options) : options_(options) {
    for (const double tilt : kTiltFactors) {
      for (const double gust : kGustFactors) {
        if (!options.UsesGusts() && gust != 1.0) continue;
        Hypothesis hypothesis{options.process, LogPrior(tilt) + LogPrior(gust)};
        hypothesis.process.tilt *= tilt;
        hypothesis.process.gust *= gust;
        hypotheses_.push_back(hypothesis);
      }
    }
    for (const double factor : kThrustFactors) {
      if (!options.MeasuresThrust() && factor != 1.0) continue;
      thrusts_.push_back({options.process, LogPrior(factor)});
      thrusts_.back().process.thrust_factor *= factor;
    }
  }

  // Adds the evidence of the passes up to `tau` (from 1); call it for each pass in turn.
  void Learn(const FlightData& flight, int tau) {
    int first = tau - 1;
    while (first > 0 && tau - first < kPasses && flight.HasArc(first)) --first;
    if (tau % kStride != 0 || tau - first < 2) return;
    const WindowData data = CutWindow(flight, options_, first, tau, false);
    if (!AddEvidence(flight, data, &hypotheses_) || thrusts_.size() == 1) return;
    for (Hypothesis& thrust : thrusts_) {
      const double factor = thrust.process.thrust_factor;
      thrust.process = Process();
      thrust.process.thrust_factor = factor;
    }
    AddEvidence(flight, data, &thrusts_);
    const double factor = MostProbable(thrusts_).process.thrust_factor;
    for (Hypothesis& hypothesis : hypotheses_) hypothesis.process.thrust_factor = factor;
  }

  // The most probable hypothesis.
  const ProcessNoise& Process() const { return MostProbable(hypotheses_).process; }

 private:
  struct Hypothesis {
    ProcessNoise process;
    double log_probability;  // up to a constant
  };
  struct Fit {
    double cost;
    double log_evidence;
  };
  Fit Solve(const FlightData& flight, const WindowData& data, const ProcessNoise& process) {
    options_.process = process;
    WindowProblem problem(flight.track, data, options_);
    const std::span<const Pass> path =
        data.offsets.empty() ? data.passes : data.passes.first(data.passes.size() - 1);
    problem.SetStart(PriorMeans(options_), RoughPath(flight.log.fixes, path));
    const double cost = problem.Solve().final_cost;
    return {cost, problem.LogEvidence()};
  }
  // Adds the evidence of a stretch to each hypothesis that is not rejected. False if the stretch
  // fits none of them.
  bool AddEvidence(const FlightData& flight, WindowData data, std::vector<Hypothesis>* hypotheses) {
    const std::vector<Hypothesis*> contenders = Contenders(hypotheses);
    std::vector<double> evidence;
    double least_cost = std::numeric_limits<double>::infinity();
    for (const Hypothesis* hypothesis : contenders) {
      const Fit fit = Solve(flight, data, hypothesis->process);
      least_cost = std::min(least_cost, fit.cost);
      evidence.push_back(fit.log_evidence);
    }
    // If no drift makes the passes consistent, fixes are false; such a term dominates the sum, so
    // it is left out. (A cost is half a sum of squares with an expectation of one for each
    // residual.)
    const double residuals = 3.0 * data.fixes.size() + 2.0 * data.forces.size();
    if (least_cost > 0.5 * kMisfit * residuals) return false;
    const double best = *std::ranges::max_element(evidence);
    // The choice of the false pass hardly affects the drift.
    const int last_pass = static_cast<int>(data.passes.size()) - 1;
    if (!flight.continuous) data.offsets = {{last_pass, kFalseOffset, kFalseOffsetRate}};
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      if (evidence[i] < best - kInconsistent && !data.offsets.empty()) {
        const double if_false =
            Solve(flight, data, contenders[i]->process).log_evidence + kLogFalse;
        evidence[i] = LogSum(evidence[i], if_false);
      }
      contenders[i]->log_probability += evidence[i];
    }
    return true;
  }
  static std::vector<Hypothesis*> Contenders(std::vector<Hypothesis>* hypotheses) {
    const double best = MostProbable(*hypotheses).log_probability;
    std::vector<Hypothesis*> contenders;
    for (Hypothesis& hypothesis : *hypotheses) {
      if (hypothesis.log_probability > best - kOut) {
        contenders.push_back(&hypothesis);
      } else {
        hypothesis.log_probability = -std::numeric_limits<double>::infinity();
      }
    }
    return contenders;
  }
  static const Hypothesis& MostProbable(const std::vector<Hypothesis>& hypotheses) {
    return *std::ranges::max_element(hypotheses, {}, &Hypothesis::log_probability);
  }

  VgdOptions options_;
  std::vector<Hypothesis> hypotheses_;  // of tilt and gust, with the best factor along the thrust
  std::vector<Hypothesis> thrusts_;     // of that factor, with the best tilt and gust
};

}  // namespace

std::vector<ProcessNoise> LearnProcess(const FlightData& flight, const VgdOptions& options) {
  std::vector<ProcessNoise> processes(flight.passes.size(), options.process);
  if (!options.adapt_drift || options.process.tilt <= 0.0) return processes;
  ProcessLearner learner(options);
  for (std::size_t i = 0; i < processes.size(); ++i) {
    learner.Learn(flight, static_cast<int>(i) + 1);
    processes[i] = learner.Process();
  }
  return processes;
}

}  // namespace trueline
