// Whether a flight contradicts the prior that a model of other flights gives it, or another flight
// of what is said to be the same vehicle.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/effects/effect.h"
#include "problems/result/estimate.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/vgd/vgd_options.h"

namespace trueline {

// Two independent statements about a parameter.
struct Statements {
  std::string name, unit;
  double one, one_sigma;      // of the prior, or of the first flight
  double other, other_sigma;  // what the flight alone shows

  double Sigmas() const;    // of the difference
  bool Contradict() const;  // the difference is larger than 4 of its standard deviations
};

// What the flight alone shows, by windows that share no data: the last window's parameters and
// those of windows before it. An estimator that carries the past has but the last.
using Estimates = std::vector<ParameterEstimate>;
std::vector<Estimates> IndependentEstimates(const EstimatorRun& run);

// What a model of other flights says of the vehicle's parameters, and what the flight alone says of
// them. Parameters that the flight does not show are left out. Its estimates were made with the
// priors `fitted_with`, which take no part.
//
// With `fitted_with` as the model this is a check of the priors by their predictive distribution
// (Evans and Moshonov 2006). A wrong prior also moves parameters that are correlated with it, so it
// tells whether the priors hold, and not which of them is wrong.
std::vector<Statements> CompareWithModel(const MotionPriors& model, const MotionPriors& fitted_with,
                                         const std::vector<Estimates>& flight);
std::vector<Statements> ContradictionsAmong(std::vector<Statements> compared);

// True if the flight contradicts a constant of the model, or all of them together. `correlations`:
// of what the flight shows, in the order of `compared`. A flight that shows a sum of two constants,
// and neither by itself, contradicts the sum only.
bool ContradictTogether(const std::vector<Statements>& compared,
                        const Eigen::MatrixXd& correlations);

// What to tell the user where a model's constants are not used as a prior, because the flight
// contradicts them. `compared`: with the flight estimated without the model. Names the constants
// that differ; where only all of them together contradict the flight, the one that differs most.
std::vector<std::string> WhyModelIsNotUsed(const std::vector<Statements>& compared);
// The same where only the model's effects are not used, because its constants agree without them.
std::string EffectsNotUsed(const std::vector<Effect>& effects);

// Calibration with the model of an earlier flight, by either drive. Where the flight contradicts
// the model's constants, its effects are left out; where the constants contradict it without them,
// too, the effects are used and the constants are not.
template <class Options, class Calibration>
struct CalibrationWithModel {
  std::function<Calibration(const Options&)> fit;
  // Whether the flight contradicts the constants; none if the fit can't tell.
  std::function<std::optional<bool>(const Options&, const Calibration&)> contradicts;
  std::function<Options(const Options&)> without_effects, without_constants;
  // The model's constants and what the flight alone shows, by a fit with the options `open`.
  std::function<std::vector<Statements>(const Options& open, const Calibration&)> compare;

  // `options` become those used. They and the result warn of what is left out.
  Calibration Run(Options* options) const {
    const Options given = *options;
    Calibration result = fit(given);
    if (contradicts(given, result) != true) return result;
    std::vector<std::string> why;
    if (!given.effects.empty()) {
      result = fit(*options = without_effects(given));
      if (contradicts(*options, result) == false) why = {EffectsNotUsed(given.effects)};
    }
    if (why.empty()) {
      result = fit(*options = without_constants(given));
      why = WhyModelIsNotUsed(compare(*options, result));
    }
    for (std::vector<std::string>* warnings : {&result.warnings, &options->warnings}) {
      warnings->insert(warnings->end(), why.begin(), why.end());
    }
    return result;
  }
};

// Parameters of the airframe of which two flights, each alone, say different things. Both were
// estimated with `priors`, which take no part.
std::vector<Statements> ConflictsBetween(const MotionPriors& priors, const Estimates& one,
                                         const Estimates& other);

// Of a flight by rotor speeds: what the model says of the constants whose prior it changes, and
// what the flight alone says of them: its fit `flight` with the prior `fitted_with`, which takes no
// part. Constants that the flight does not show are left out.
std::vector<Statements> CompareWithModel(const RotorPrior& model, const RotorPrior& fitted_with,
                                         const RotorBatchResult& flight);

// True if the flight contradicts the model's constants, each by itself or all together. The model
// states no correlations: its prior is that of independent constants, also in a fit.
bool Contradicts(const RotorPrior& model, const RotorPrior& fitted_with,
                 const RotorBatchResult& flight);

// The configuration's prior without the model, for a flight that the model's prior was meant for.
// Constants that the configuration lacks (known to be zero) and the model has, such as drag, are
// forces of the vehicle as effects are. Without them the other constants would come out wrong, so
// they stay: those that the model estimated with a prior as wide as its value is large.
RotorPrior WithoutModel(RotorPrior configured, const RotorPrior& with_model);

}  // namespace trueline
