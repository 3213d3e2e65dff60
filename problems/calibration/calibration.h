// Calibration of one flight: log in; model, trajectory, uncertainties and a verdict out.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/calibration/estimators.h"
#include "problems/effects/effect.h"
#include "problems/inspection/first_look.h"
#include "problems/result/estimate.h"
#include "problems/result/statistics.h"

namespace trueline {

struct CalibrationOptions {
  std::vector<std::string> estimators = {"vgd"};
  // The same flight with other window lengths, for comparison; methods.vgd.gamma is reported.
  std::vector<int> gamma_sweep = {1, 2, 3, 4, 5};
  EstimatorOptions methods;
  std::vector<Effect> effects;  // of the model (trueline-diagnose), corrected in the log
  // The priors before those of the model (--model), which take their place if the flight
  // contradicts the model's.
  std::optional<MotionPriors> priors_without_model;
  std::vector<std::string> warnings;  // from reading
};

// Final-point errors and coverage over the arcs of one run: those with mocap truth if there are
// any, else those with truth from the next pass's fixes.
struct ArcSummary {
  ErrorSummary error;  // m
  int inside_95 = 0;   // arcs whose truth lies inside of the 95 % ellipse
  double Coverage() const { return error.count > 0 ? double(inside_95) / error.count : 0.0; }
};
ArcSummary SummariseArcs(const EstimatorRun& run);

struct Verdict {
  std::string word;  // usable | poor | unusable
  std::vector<std::string> reasons;
};

struct Calibration {
  std::vector<EstimatorRun> runs;             // estimators x gammas
  std::size_t reported = 0;                   // index of the run that calibration.yaml describes
  std::optional<WholeFlight> whole_flight;    // where the smoother ran
  std::optional<ContinuousFixes> continuous;  // of a flight without gates
  Verdict verdict;
  std::vector<std::string> warnings;
  // What the runs were estimated with: the model's, unless the flight contradicts them.
  std::vector<Effect> effects;  // for model.yaml
  MotionPriors priors{};

  const EstimatorRun& Reported() const { return runs[reported]; }
};

// A reason makes a verdict `poor` at best.
void AddReasons(const std::vector<std::string>& reasons, Verdict* verdict);
// Judges a run by its last window and its arcs. `from_mocap`: the fixes are mocap's positions.
Verdict Judge(const EstimatorRun& run, bool from_mocap = false);
// Adds what the whole flight's learned strengths tell: a model with much noise explains anything.
void JudgeStrengths(const WholeFlight& whole, Verdict* verdict);

// Delays of streams that the fit has estimated: late fixes are no fault of a log whose fit allows
// for them.
struct StreamDelay {
  std::string stream;
  double value, sigma;  // s
};
std::vector<StreamDelay> DelaysOf(const Calibration& calibration);

// Adds faults of `log` and of further flights, which make parameters wrong however well the model
// fits. A clock of `log` that is off by a delay that the fit has found as well is none.
void JudgeLog(const FlightLog& log, const std::vector<LogFault>& faults,
              const std::vector<StreamDelay>& delays, Verdict* verdict);

// One estimator with one window length.
struct PlannedRun {
  std::string estimator;
  int gamma;
};

// The runs of Calibrate: all estimators, each with the window lengths that affect it.
std::vector<PlannedRun> PlanRuns(const CalibrationOptions& options);

// With a model (--model) as far as the flight does not contradict it: CalibrationWithModel.
//
// Throws InputError for bad input; a flight that shows nothing gives the verdict `unusable`. If the
// smoother is among the estimators, the whole flight is also solved at once; `others` are flights
// of the same vehicle, which then share its drag and misalignment. `done` is called after each
// planned run.
Calibration Calibrate(
    const FlightLog& log, CalibrationOptions options, const std::vector<FlightLog>& others = {},
    std::function<void()> done = [] {});

}  // namespace trueline
