#include "problems/calibration/calibration.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "problems/calibration/conflict.h"
#include "problems/common/error.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

bool HasStatus(const WindowEstimate& window, const std::string& name, const std::string& status) {
  return std::any_of(
      window.parameters.begin(), window.parameters.end(),
      [&](const ParameterEstimate& p) { return p.name == name && p.status == status; });
}

std::vector<std::string> NamesWithStatus(const WindowEstimate& window, const std::string& status) {
  std::vector<std::string> names;
  for (const ParameterEstimate& p : window.parameters) {
    if (p.status == status) names.push_back(p.name);
  }
  return names;
}

// Coverage far below 95 % is a defect of the stated uncertainty, unless its binomial probability is
// not small.
constexpr double kChance = 0.01;

// A flight is a hover if nine tenths of its fitted path lie within the scatter that the fixes' own
// noise gives (3 sigma), or within half a metre of the middle without showing a drag. Any drag
// fitted to it is noise.
constexpr double kHoverExtent = 0.5;  // m
constexpr double kHoverSigmas = 3.0;

// The distance from the middle that contains nine tenths of the fitted passes, m.
double ExtentOf(const EstimatorRun& run) {
  std::array<std::vector<double>, 3> axes;
  for (const WindowEstimate& window : run.windows) {
    for (const TrajectoryPoint& point : window.fitted) {
      for (int i = 0; i < 3; ++i) axes[i].push_back(point.p_E[i]);
    }
  }
  const Eigen::Vector3d middle(Quantile(axes[0], 0.5), Quantile(axes[1], 0.5),
                               Quantile(axes[2], 0.5));
  std::vector<double> distances;
  for (std::size_t k = 0; k < axes[0].size(); ++k) {
    distances.push_back((Eigen::Vector3d(axes[0][k], axes[1][k], axes[2][k]) - middle).norm());
  }
  return Quantile(distances, 0.9);
}

bool ShowsDrag(const WindowEstimate& window) {
  return std::any_of(window.parameters.begin(), window.parameters.end(),
                     [](const ParameterEstimate& p) {
                       return (p.name == "K_x" || p.name == "K_y") && p.status != "unobservable";
                     });
}

bool Hovers(const EstimatorRun& run) {
  std::vector<double> sigmas;
  for (const WindowEstimate& window : run.windows) {
    for (const FixMisfit& misfit : window.misfits) sigmas.push_back(misfit.sigma);
  }
  const double noise = sigmas.empty() ? 0.0 : kHoverSigmas * Quantile(sigmas, 0.5);
  const double extent = ExtentOf(run);
  return extent < noise || (extent < kHoverExtent && !ShowsDrag(run.windows.back()));
}

// A flight of few arcs tells little: a model is relied on if so many ends lie inside of their
// ellipses that a model with every second end inside would reach it with a chance below this. Five
// of five arcs do, three of five or five of six do not. Errors of successive arcs, divided by their
// sigmas, are not correlated (0.00 over 912 arcs of simulated flights), so arcs count singly.
constexpr double kChanceOfCount = 0.05;

bool MayBeLucky(const ArcSummary& arcs) {
  return 1.0 - BinomialCdf(arcs.inside_95 - 1, arcs.error.count, 0.5) > kChanceOfCount;
}

void JudgeArcs(const EstimatorRun& run, Verdict* verdict) {
  const ArcSummary arcs = SummariseArcs(run);
  if (arcs.error.count == 0) {
    verdict->reasons.emplace_back(
        "no arc to check the prediction on: the log holds a single pass, or no truth at the arcs' "
        "ends");
  } else if (BinomialCdf(arcs.inside_95, arcs.error.count, 0.95) < kChance) {
    verdict->reasons.push_back(fmt::format(
        "the stated uncertainty is too small: {} of {} arcs end inside of their 95 % ellipse; the "
        "flight holds more than the noise assumed (in gusts of another memory, set process: "
        "gust_memory_s)",
        arcs.inside_95, arcs.error.count));
  } else if (MayBeLucky(arcs)) {
    verdict->reasons.push_back(fmt::format(
        "too few arcs to tell a good model from a lucky one: {} of {} end inside of their 95 % "
        "ellipse; five of five or seven of eight would do. Fly more laps",
        arcs.inside_95, arcs.error.count));
  }
}

// Where so many passes contradict the flight between them, the flight is what is wrong.
void JudgePasses(const EstimatorRun& run, Verdict* verdict) {
  constexpr double kMostFalse = 0.34;  // of the passes
  const std::size_t wrong = run.false_passes.size();
  if (wrong < 2 || wrong <= kMostFalse * run.windows.size()) return;
  verdict->reasons.push_back(fmt::format(
      "{} of {} passes look false; where so many contradict the flight between them, "
      "more likely the attitude, the clocks or the model is wrong (trueline inspect compares "
      "the streams)",
      wrong, run.windows.size()));
}

// Fixes of ten measured flights scatter by 0.4 to 1.0 times their sigmas.
void JudgeFixes(const EstimatorRun& run, bool from_mocap, Verdict* verdict) {
  constexpr double kMedianNorm = 1.538;  // of three standard normal numbers
  constexpr double kMost = 2.0;
  std::vector<double> norms;
  for (const WindowEstimate& window : run.windows) {
    for (const FixMisfit& misfit : window.misfits) {
      norms.push_back(misfit.error.norm() / misfit.sigma);
    }
  }
  const double times = norms.empty() ? 0.0 : UpperMedian(std::move(norms)) / kMedianNorm;
  if (times <= kMost) return;
  verdict->reasons.push_back(
      fmt::format("the fixes scatter {:.1f} times as much as their sigmas state, so the intervals "
                  "are too small; {}",
                  times,
                  from_mocap ? "the fixes are mocap's positions: give them as fixes.csv, with the "
                               "sigma that they have"
                             : "multiply 'sigma' in fixes.csv by it"));
}

// The largest strengths of ordinary flights.
struct Ordinary {
  const char* name;
  double most;  // in the strength's unit
  const char* cause;
};
constexpr Ordinary kOrdinary[] = {
    {"tilt_drift", 0.12, "the logged attitude is not that of the flight (wrong frame or clock?)"},
    {"acceleration", 1.0, "forces act that no model here has"},
    {"thrust", 1.0,
     "the accelerometer's z axis is useless (try --thrust=level_flight), or forces act along it "
     "that it does not measure"},
    {"gust", 2.0,
     "strong gusts, or the accelerometer's x and y axes are useless (set "
     "drag_measurement: {enabled: false})"}};

}  // namespace

void AddReasons(const std::vector<std::string>& reasons, Verdict* verdict) {
  verdict->reasons.insert(verdict->reasons.end(), reasons.begin(), reasons.end());
  if (!reasons.empty() && verdict->word == "usable") verdict->word = "poor";
}

void JudgeStrengths(const WholeFlight& whole, Verdict* verdict) {
  std::vector<std::string> reasons;
  for (const LearnedStrength& strength : whole.strengths) {
    for (const Ordinary& ordinary : kOrdinary) {
      if (strength.name != ordinary.name || strength.value <= ordinary.most) continue;
      reasons.push_back(
          fmt::format("the flight needs {} of {:.2g} {}, ordinary is at most {:.2g}: {}",
                      strength.name, strength.value, strength.unit, ordinary.most, ordinary.cause));
    }
  }
  AddReasons(reasons, verdict);
}

std::vector<StreamDelay> DelaysOf(const Calibration& calibration) {
  const std::vector<WindowEstimate>& windows = calibration.Reported().windows;
  if (windows.empty() || !windows.back().fix_latency) return {};
  const ParameterEstimate& delay = *windows.back().fix_latency;
  return {{"fixes", delay.value, delay.sigma}};
}

namespace {

bool IsEstimatedDelay(const LogFault& fault, const std::vector<StreamDelay>& delays) {
  constexpr double kSigmas = 3.0, kOfFirstLook = 0.03;  // s, its own error
  return fault.kind == &fault::kClockOffset && !fault.fatal &&
         std::any_of(delays.begin(), delays.end(), [&](const StreamDelay& delay) {
           return delay.stream == fault.stream &&
                  std::abs(delay.value - fault.size) < kSigmas * delay.sigma + kOfFirstLook;
         });
}

}  // namespace

void JudgeLog(const FlightLog& log, const std::vector<LogFault>& faults,
              const std::vector<StreamDelay>& delays, Verdict* verdict) {
  std::vector<std::string> reasons;
  for (const LogFault& fault : faults) {
    const bool further = fault.log != log.directory;
    if (!further && IsEstimatedDelay(fault, delays)) continue;
    reasons.push_back(fmt::format("{} has a fault, which the intervals do not include: {}",
                                  further ? fault.log : "the log", fault.text));
  }
  AddReasons(reasons, verdict);
}

ArcSummary SummariseArcs(const EstimatorRun& run) {
  const bool mocap = std::any_of(run.windows.begin(), run.windows.end(), [](const auto& w) {
    return w.arc && w.arc->truth_source == "mocap";
  });
  ArcSummary summary;
  std::vector<double> errors;
  for (const WindowEstimate& window : run.windows) {
    if (!window.arc || !window.arc->truth) continue;
    if (mocap && window.arc->truth_source != "mocap") continue;
    errors.push_back(window.arc->FinalPointError());
    summary.inside_95 += window.arc->Inside95();
  }
  summary.error = Summarise(errors);
  return summary;
}

Verdict Judge(const EstimatorRun& run, bool from_mocap) {
  if (run.windows.empty()) {
    return {
        "unusable",
        {"no pass to fit: the fixes come singly, with longer pauses than pass_gap_s between them "
         "(hovering, or a detector that sees too little). Fly laps through the gates"}};
  }
  if (Hovers(run)) {
    return {
        "unusable",
        {fmt::format("the vehicle stays within {:.2f} m (hovering), so nothing shows its drag. Fly "
                     "laps with straights and turns at racing speed",
                     ExtentOf(run))}};
  }
  const WindowEstimate& last = run.windows.back();
  Verdict verdict{"usable", {}};
  if (HasStatus(last, "K_x", "unobservable") && HasStatus(last, "K_y", "unobservable")) {
    verdict.reasons.emplace_back(
        "the last window shows no drag; K_x and K_y are the prior's. Fly laps with straights and "
        "turns");
  }
  if (!last.converged) verdict.reasons.emplace_back("the last window's solve did not converge");
  if (const auto names = NamesWithStatus(last, "at_bound"); !names.empty()) {
    verdict.reasons.push_back(fmt::format(
        "{} ended at the bound of what is plausible; the model or the log's frames may be wrong",
        fmt::join(names, ", ")));
  }
  JudgeArcs(run, &verdict);
  JudgePasses(run, &verdict);
  JudgeFixes(run, from_mocap, &verdict);
  if (!verdict.reasons.empty()) verdict.word = "poor";
  return verdict;
}

std::vector<PlannedRun> PlanRuns(const CalibrationOptions& options) {
  const int reported = options.methods.vgd.gamma;
  std::set<int> gammas(options.gamma_sweep.begin(), options.gamma_sweep.end());
  gammas.insert(reported);
  std::vector<PlannedRun> runs;
  for (const std::string& estimator : options.estimators) {
    for (const int gamma : gammas) {
      if (gamma == reported || FindEstimator(estimator).windows) runs.push_back({estimator, gamma});
    }
  }
  return runs;
}

namespace {

std::vector<FlightLog> CorrectLogs(const std::vector<FlightLog>& logs,
                                   const std::vector<Effect>& effects) {
  std::vector<FlightLog> corrected;
  corrected.reserve(logs.size());
  for (const FlightLog& log : logs) corrected.push_back(CorrectLog(log, effects));
  return corrected;
}

// Another flight of the vehicle, and what it shows by itself.
struct OtherFlight {
  std::string name;
  std::unique_ptr<FlightData> data;
  EstimatorRun alone;
};

// Flights with passes, by the fixed-lag smoother, which also finds their false passes.
std::vector<OtherFlight> RunOthers(const std::vector<FlightLog>& logs, const EstimatorRun& lagged,
                                   const EstimatorOptions& methods) {
  const VgdOptions& vgd = methods.vgd;
  std::vector<OtherFlight> others;
  for (const FlightLog& log : logs) {
    auto data = std::make_unique<FlightData>(log, vgd.drive, vgd.passes, vgd.drag_measurement);
    if (data->passes.empty()) continue;
    EstimatorRun alone = Estimators(*data, methods).Run(lagged.estimator, vgd.gamma);
    others.push_back({log.directory, std::move(data), std::move(alone)});
  }
  return others;
}

FlightShare ShareOf(const FlightData& flight, const EstimatorRun& lagged) {
  return {&flight, {lagged.false_passes.begin(), lagged.false_passes.end()}};
}

// Solves the whole flight, together with other flights of the vehicle.
WholeFlight SolveWhole(const FlightData& flight, const EstimatorRun& lagged,
                       const std::vector<OtherFlight>& others, const EstimatorOptions& methods) {
  std::vector<FlightShare> shares{ShareOf(flight, lagged)};
  for (const OtherFlight& other : others) shares.push_back(ShareOf(*other.data, other.alone));
  return RunWholeFlight(shares, methods.vgd, methods.smoother, methods.whole_flight);
}

std::vector<ParameterEstimate> ShownAlone(const FlightShare& share,
                                          const EstimatorOptions& methods) {
  return RunWholeFlight({share}, methods.vgd, methods.smoother, methods.whole_flight).parameters;
}

// The mean of two vehicles is the model of neither.
std::vector<std::string> ContradictionsOf(const FlightData& flight, const EstimatorRun& lagged,
                                          const std::vector<OtherFlight>& others,
                                          const EstimatorOptions& methods) {
  std::vector<std::string> contradictions;
  if (others.empty()) return contradictions;
  const std::vector<ParameterEstimate> first = ShownAlone(ShareOf(flight, lagged), methods);
  for (const OtherFlight& other : others) {
    const auto alone = ShownAlone(ShareOf(*other.data, other.alone), methods);
    for (const Statements& c : ConflictsBetween(methods.vgd.priors, first, alone)) {
      contradictions.push_back(fmt::format(
          "the flights contradict each other: of {} the first alone shows {:.3g} +- {:.2g} {}, {} "
          "alone {:.3g} +- {:.2g}; what is fitted to both holds for neither: two vehicles, or "
          "forces that the model lacks",
          c.name, c.one, c.one_sigma, c.unit, other.name, c.other, c.other_sigma));
    }
  }
  return contradictions;
}

// Calibrate, with the priors as they are.
Calibration CalibrateWith(const FlightLog& log, const CalibrationOptions& options,
                          const std::vector<FlightLog>& others, const std::function<void()>& done) {
  const VgdOptions& vgd = options.methods.vgd;
  std::optional<FlightLog> corrected;  // a copy only where there is something to correct
  if (!options.effects.empty()) corrected = CorrectLog(log, options.effects);
  const FlightData flight(corrected ? *corrected : log, vgd.drive, vgd.passes,
                          vgd.drag_measurement);
  Calibration calibration;
  calibration.warnings = log.warnings;
  const std::vector<std::string> of_others = WarningsByFlight(others);
  calibration.warnings.insert(calibration.warnings.end(), of_others.begin(), of_others.end());
  calibration.warnings.insert(calibration.warnings.end(), options.warnings.begin(),
                              options.warnings.end());
  calibration.effects = options.effects;
  calibration.priors = vgd.priors;
  calibration.continuous = flight.continuous;
  Estimators estimators(flight, options.methods);
  for (const PlannedRun& run : PlanRuns(options)) {
    if (run.estimator == options.estimators.front() && run.gamma == vgd.gamma) {
      calibration.reported = calibration.runs.size();
    }
    calibration.runs.push_back(estimators.Run(run.estimator, run.gamma));
    done();
  }
  std::vector<std::string> contradictions;
  const std::vector<FlightLog> other_logs = CorrectLogs(others, options.effects);
  for (const EstimatorRun& run : calibration.runs) {
    if (!FindEstimator(run.estimator).whole_flight) continue;
    if (run.gamma != vgd.gamma || run.windows.empty()) continue;
    const std::vector<OtherFlight> more = RunOthers(other_logs, run, options.methods);
    calibration.whole_flight = SolveWhole(flight, run, more, options.methods);
    contradictions = ContradictionsOf(flight, run, more, options.methods);
  }
  const EstimatorRun& reported = calibration.Reported();
  calibration.warnings.insert(calibration.warnings.end(), reported.warnings.begin(),
                              reported.warnings.end());
  calibration.verdict =
      Judge(reported, calibration.continuous && calibration.continuous->from_mocap);
  if (calibration.whole_flight) JudgeStrengths(*calibration.whole_flight, &calibration.verdict);
  AddReasons(contradictions, &calibration.verdict);
  return calibration;
}

}  // namespace

Calibration Calibrate(const FlightLog& log, CalibrationOptions options,
                      const std::vector<FlightLog>& others, std::function<void()> done) {
  const MotionPriors model = options.methods.vgd.priors;
  const bool with_model = options.priors_without_model.has_value();
  const CalibrationWithModel<CalibrationOptions, Calibration> calibration{
      .fit =
          [&](const auto& o) { return CalibrateWith(log, o, others, std::exchange(done, [] {})); },
      .contradicts = [&](const auto&, const auto& fit) -> std::optional<bool> {
        if (!with_model) return std::nullopt;
        const std::vector<Estimates> shown = IndependentEstimates(fit.Reported());
        return !ContradictionsAmong(CompareWithModel(model, model, shown)).empty();
      },
      .without_effects =
          [](CalibrationOptions o) {
            o.effects.clear();
            o.methods.vgd.drive.force_effects = {};
            return o;
          },
      .without_constants =
          [](CalibrationOptions o) {
            o.methods.vgd.priors = *o.priors_without_model;
            return o;
          },
      .compare =
          [&](const auto& open, const auto& fit) {
            return CompareWithModel(model, open.methods.vgd.priors,
                                    IndependentEstimates(fit.Reported()));
          }};
  return calibration.Run(&options);
}

}  // namespace trueline
