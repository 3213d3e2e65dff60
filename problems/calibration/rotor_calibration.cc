#include "problems/calibration/rotor_calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "problems/calibration/conflict.h"
#include "problems/calibration/considered.h"
#include "problems/calibration/learn_rotor_noise.h"
#include "problems/common/error.h"
#include "problems/effects/declaration.h"
#include "problems/result/identifiability.h"
#include "problems/result/statistics.h"
#include "problems/rotor/rotor_batch.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr double kFirstStart = 1.0;  // s after the first pose

// `data` with the speeds of motors that have these constants.
RotorData DrivenBy(const RotorConstants& constants, const RotorData& data) {
  RotorData driven = data;
  if (driven.motors) driven.SimulateMotors(MotorsOf(constants));
  return driven;
}

// Of the filter that follows the flight with these constants.
RotorEkfOptions Following(const RotorConstants& calibrated, const RotorNoise& noise) {
  RotorEkfOptions options;
  options.noise = noise;
  options.prior.mean = calibrated;
  return options;
}

}  // namespace

std::vector<OpenLoopError> PredictOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                           const RotorNoise& noise,
                                           const RotorConstants& calibrated,
                                           const RotorConstants& constants,
                                           const std::vector<double>& horizons, double spacing) {
  const RotorEkfRun run =
      RunOrDiverge(model, DrivenBy(calibrated, data), Following(calibrated, noise));
  const RotorData driven = DrivenBy(constants, data);
  std::vector<OpenLoopError> errors;
  double next = data.poses.front().t + kFirstStart;
  for (const RotorEstimate& start : run.history) {
    if (start.t < next) continue;
    next = start.t + spacing;
    for (const double horizon : horizons) {
      const RotorPose* pose = PoseNear(data, start.t + horizon);
      if (pose == nullptr) continue;
      Eigen::Vector3d drift = start.node.drift;
      const RotorState end = Integrated(model, driven, noise, Joined(start.node.motion, constants),
                                        &drift, start.t, pose->t);
      errors.push_back({start.t, horizon, (SensedPosition(end) - pose->p_E).norm()});
    }
  }
  return errors;
}

std::vector<RotorForecast> ForecastOpenLoop(const RotorAeroModel& model, const RotorData& data,
                                            const RotorNoise& noise,
                                            const RotorConstants& calibrated,
                                            const std::vector<double>& horizons, double spacing) {
  RotorEkfOptions options = Following(calibrated, noise);
  options.forecast = {horizons, spacing, kFirstStart};
  return RunOrDiverge(model, DrivenBy(calibrated, data), options).forecasts;
}

namespace {

constexpr double kShortestPart = 1.0;  // s, of a flight that is fitted or held out
constexpr double kNotABody = 1e-3;     // share of the trace, of the smallest second moment
constexpr double kHalvesDiffer = 3.0;  // sigmas
constexpr double kPoorFit = 1.5;       // whitened squares by degree of freedom
constexpr double kWorse = 1.2;         // prediction error, over that of the nominal vehicle
constexpr double kLeastInside = 0.5;   // of predictions, inside the 95 % region of the noise
constexpr double kLargeBias = 0.5;  // of a constant's value, of what noise on the speeds did to it
constexpr int kEnoughStarts = 20;   // of predictions, for such a share

RotorDataOptions Part(const RotorDataOptions& whole, double start, double duration) {
  RotorDataOptions part = whole;
  part.start += start;
  if (start != 0.0) part.speeds.reset();
  part.duration = duration;
  return part;
}

double Duration(const RotorData& data) { return data.poses.back().t - data.poses.front().t; }

// The smallest second moment of mass that the inertia implies, as a share of the inertia's trace.
double ThinnestShare(const RotorConstants& constants) {
  const Eigen::Vector3d inertia = constants.segment<3>(kInertiaConstants);
  return (0.5 * inertia.sum() - inertia.maxCoeff()) / inertia.sum();
}

// The flight's halves show how far its constants scatter: where they differ by more than three of
// their sigmas, the intervals are widened until it is two.
void CompareHalves(const RotorAeroModel& model, const FlightLog& log,
                   const RotorBatchOptions& batch, const RotorDataOptions& data, double fitted,
                   RotorCalibration* result) {
  const int rotors = model.num_rotors();
  const RotorBatchResult a =
      RunRotorBatch(model, MakeRotorData(log, rotors, Part(data, 0.0, 0.5 * fitted)), batch);
  const RotorBatchResult b = RunRotorBatch(
      model, MakeRotorData(log, rotors, Part(data, 0.5 * fitted, 0.5 * fitted)), batch);
  RotorConstants factors = RotorConstants::Ones();
  for (const int i : batch.prior.Free()) {
    const double sigma = std::sqrt(a.cov(i, i) + b.cov(i, i));
    const double difference = std::abs(a.mean[i] - b.mean[i]) / sigma;
    if (difference > kHalvesDiffer) {
      const bool bias = kRotorConstants[i].group == RotorConstantGroup::kBias;
      auto& disagree = bias ? result->biases_differ : result->halves_disagree;
      disagree.push_back(fmt::format("{} ({:.1f})", kRotorConstants[i].name, difference));
      factors[i] = 0.5 * difference;
    }
    if (difference <= result->halves) continue;
    result->halves = difference;
    result->halves_parameter = kRotorConstants[i].name;
  }
  result->batch.Widen(factors);
}

// The fitted part of a flight, with what was learned of its streams and noise.
struct FittedPart {
  const FlightLog& log;
  const RotorAeroModel& model;
  const RotorDataOptions& streams;
  const RotorData& data;
  const RotorNoise& noise;
  double duration;  // s
};

// The batch, with intervals that contain what the noise model lacks. `start`: a solution nearby, or
// null.
void EstimateConstants(const FittedPart& part, const RotorCalibrationOptions& options,
                       const RotorBatchResult* start, RotorCalibration* result) {
  RotorBatchOptions batch{part.noise, options.prior, options.robust_pose};
  batch.widen = options.widen;
  result->batch = RunRotorBatch(part.model, part.data, batch, start);
  if (!std::isfinite(result->batch.cost)) return;
  result->batch =
      WithoutSpeedNoiseBias(part.model, part.data, batch, result->batch, &result->speed_noise_bias);
  result->batch.cov += ConsideredCovariance(
      part.model, part.data, batch, result->batch,
      ConsideredVariants(part.log, options, Part(part.streams, 0.0, part.duration)));
  CompareHalves(part.model, part.log, batch, part.streams, part.duration, result);
}

RotorCalibrationOptions WithoutConstants(RotorCalibrationOptions options) {
  options.prior = *options.prior_without_model;
  options.prior_without_model.reset();
  if (options.data.motors) options.data.motors_at = MotorsOf(options.prior.mean);
  return options;
}

// The batch without the model's prior, from the solution with it. That prior may be wrong and as
// sharp as the data; what it hides, no residual and no estimate under it tells. Intervals are
// widened as those of a calibration are: where halves of the flight disagree, its constants
// contradict less.
std::optional<RotorBatchResult> FitAlone(const FittedPart& part,
                                         const RotorCalibrationOptions& options,
                                         const RotorBatchResult& with_model) {
  RotorCalibration alone;
  try {
    EstimateConstants(part, WithoutConstants(options), &with_model, &alone);
  } catch (const InputError&) {  // a half runs away from its flight
    return std::nullopt;
  }
  const bool solved = std::isfinite(alone.batch.cost) && alone.batch.converged;
  return solved ? std::optional(alone.batch) : std::nullopt;
}

// Speeds from commands are linearised in the motors' unknowns. Filter and noise learning use the
// linearisation at a first batch's estimate instead of the prior's mean.
void RelineariseMotors(const RotorAeroModel& model, const FlightLog& log,
                       const RotorCalibrationOptions& options, double fitted,
                       RotorDataOptions* streams, RotorEkfOptions* filter) {
  constexpr double kNear = 0.4;  // of the noise's logarithm
  if (MotorsOf(options.prior.sigma).maxCoeff() == 0.0) return;
  const RotorData data = MakeRotorData(log, model.num_rotors(), Part(*streams, 0.0, fitted));
  const RotorBatchResult batch =
      RunRotorBatch(model, data, {filter->noise, options.prior, options.robust_pose});
  const MotorValues at = MotorsOf(batch.mean);
  if (!(at[kLag] > 0.0)) return;  // JudgeRotors says so
  streams->motors_at = at;
  LearnFromFlight(model, log,
                  {options.learn_noise, false, false, std::min(fitted, RotorLearning().seconds),
                   options.noise, kNear},
                  streams, filter);
}

std::vector<double> ErrorsAt(double horizon, const std::vector<OpenLoopError>& all) {
  std::vector<double> errors;
  for (const OpenLoopError& e : all) {
    if (e.horizon == horizon) errors.push_back(e.error);
  }
  return errors;
}

void ScorePredictions(const RotorAeroModel& model, const RotorData& fitted,
                      const RotorData& held_out, const RotorCalibrationOptions& options,
                      RotorCalibration* result) {
  constexpr double kSpacing = 0.1;                        // s
  const std::vector<double> horizons = {0.25, 0.5, 1.0};  // s
  result->open_loop =
      ForecastOpenLoop(model, held_out, result->noise, result->batch.mean, horizons, kSpacing);
  for (RotorForecast& forecast : result->open_loop) {
    forecast.t += SecondsBetween(result->origin, held_out.origin);
  }
  const std::vector<OpenLoopError> before = PredictOpenLoop(
      model, held_out, result->noise, result->batch.mean, options.prior.mean, horizons, kSpacing);
  const std::vector<OpenLoopError> learned = PredictOpenLoop(
      model, fitted, result->noise, result->batch.mean, result->batch.mean, horizons, kSpacing);
  for (const double horizon : horizons) {
    HorizonScore score{horizon};
    double squares = 0.0;
    for (const double error : ErrorsAt(horizon, before)) score.before += error;
    const std::vector<double> fits = ErrorsAt(horizon, learned);
    for (std::size_t k = 0; k < score.radius.size() && !fits.empty(); ++k) {
      score.radius[k] = Quantile(fits, kRegionLevels[k]);
    }
    for (const RotorForecast& e : result->open_loop) {
      if (e.horizon != horizon) continue;
      ++score.count;
      score.after += e.error;
      squares += e.error * e.error;
      for (std::size_t k = 0; k < score.inside.size(); ++k) {
        score.inside[k] += e.error <= score.radius[k];
      }
      score.inside_noise += e.rank <= 0.95;
    }
    if (score.count > 0) {
      score.before /= score.count;
      score.after /= score.count;
      score.after_rms = std::sqrt(squares / score.count);
      for (double& share : score.inside) share /= score.count;
      score.inside_noise /= score.count;
    }
    result->predictions.push_back(score);
  }
}

std::vector<std::string> FaultsOfPredictions(const std::vector<HorizonScore>& predictions) {
  std::vector<std::string> faults;
  const auto worse = std::find_if(
      predictions.begin(), predictions.end(),
      [](const HorizonScore& s) { return s.count > 0 && s.after > kWorse * s.before; });
  if (worse != predictions.end()) {
    faults.push_back(
        fmt::format("the fit predicts held-out flight worse than the nominal vehicle does over "
                    "{} s ({:.3f} m against {:.3f} m)",
                    worse->horizon, worse->after, worse->before));
  }
  // The shortest horizon at which the poses show errors.
  const auto first = std::ranges::find_if(
      predictions, [](const HorizonScore& s) { return s.count >= kEnoughStarts; });
  if (first != predictions.end() && first->inside_noise < kLeastInside) {
    faults.push_back(fmt::format(
        "the model lacks something: noise explains {:.0f} % of the errors over {} s on "
        "held-out flight where it should explain 95 %, so the intervals are too narrow; "
        "trueline diagnose looks for what is missing",
        100.0 * first->inside_noise, first->horizon));
  }
  return faults;
}

// A bias is known to first order. What is left of one as large as the constant is no small error.
std::vector<std::string> LargeBiases(const RotorCalibration& c) {
  std::vector<std::string> texts;
  for (const ParameterEstimate& p : c.parameters) {
    const double bias = c.speed_noise_bias[FindRotorConstant(p.name)];
    if (!p.name.starts_with("I_") || std::abs(bias) < kLargeBias * std::abs(p.value)) continue;
    texts.push_back(fmt::format(
        "noise of {:.0f} rad/s on the rotor speeds moved {} by {:+.0f} %; so large a correction is "
        "inexact: log speeds with less noise",
        c.speed_sigma, p.name, 100.0 * bias / p.value));
  }
  return texts;
}

const ParameterEstimate* Named(const std::string& name, const RotorCalibration& c) {
  const auto found = std::ranges::find(c.parameters, name, &ParameterEstimate::name);
  return found == c.parameters.end() ? nullptr : &*found;
}

// The pose's residual is linear in the delay.
void JudgeDelay(const RotorCalibration& c, std::vector<std::string>* reasons) {
  constexpr double kLinear = 0.04;  // s
  const ParameterEstimate* delay = Named("pose_delay", c);
  if (delay == nullptr || std::abs(delay->value) < kLinear) return;
  reasons->push_back(fmt::format(
      "the poses come {:.3f} s {}, more than the model allows for ({} s); add {:+.3f} s "
      "to their stamps (trueline inspect writes the corrected map)",
      std::abs(delay->value), delay->value > 0.0 ? "late" : "early", kLinear, -delay->value));
}

// One segment lasts from a pose to the next. Errors of the forces add up over it.
void JudgePauses(const RotorCalibration& c, std::vector<std::string>* reasons) {
  constexpr double kLongest = 0.6;  // s
  double longest = 0.0;
  for (std::size_t i = 1; i < c.pose_times.size(); ++i) {
    longest = std::max(longest, c.pose_times[i] - c.pose_times[i - 1]);
  }
  if (longest < kLongest) return;
  reasons->push_back(
      fmt::format("the poses pause for up to {:.2f} s: over pauses of more than {} s the errors of "
                  "the forces add up, and constants come out wrong; fit a stretch without a pause "
                  "(start, duration)",
                  longest, kLongest));
}

Verdict JudgeRotors(const RotorCalibration& c) {
  std::vector<std::string> reasons;
  const auto identified = std::count_if(c.parameters.begin(), c.parameters.end(),
                                        [](const auto& p) { return p.status == "identified"; });
  if (!c.halves_disagree.empty()) {
    reasons.push_back(fmt::format(
        "the halves of the flight disagree (by this many of their sigmas) on {}: the model lacks "
        "something; the intervals of these constants are widened until the halves agree within two",
        fmt::join(c.halves_disagree, ", ")));
  }
  if (c.chi_square > kPoorFit) {
    reasons.push_back(
        fmt::format("residuals are {:.1f} times what the noise explains; set learn_noise: true or "
                    "correct the noise",
                    c.chi_square));
  }
  for (const ParameterEstimate& p : c.parameters) {
    if (p.status == "at_bound") {
      reasons.push_back(p.name + " ended on the bound of physical inertias");
    }
    if (p.name == "motor_lag" && !(p.value > 0.0)) {
      reasons.emplace_back(
          "motor_lag is not above 0 s: the commands are stamped later than the motors respond; "
          "check clocks");
    }
  }
  JudgeDelay(c, &reasons);
  JudgePauses(c, &reasons);
  for (const std::string& text : LargeBiases(c)) reasons.push_back(text);
  for (const std::string& fault : FaultsOfPredictions(c.predictions)) reasons.push_back(fault);
  Verdict verdict{"usable", {}};
  AddReasons(reasons, &verdict);
  if (!c.batch.converged || identified < 3) {
    verdict.word = "unusable";
    verdict.reasons.emplace_back(
        c.batch.converged ? "this flight determines fewer than three constants; fly more "
                            "(trueline design proposes how)"
                          : "the fit did not converge; check frames, rotor order and priors");
  }
  return verdict;
}

}  // namespace

void DescribeConstants(const RotorBatchResult& batch, const RotorPrior& prior,
                       std::vector<ParameterEstimate>* parameters,
                       std::vector<std::string>* unobservable) {
  const std::vector<int> free = prior.Free();
  const auto n = static_cast<Eigen::Index>(free.size());
  std::vector<std::string> names, units;
  Eigen::VectorXd scale(n);
  Eigen::MatrixXd cov(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    names.push_back(kRotorConstants[free[i]].name);
    units.push_back(kRotorConstants[free[i]].unit);
    scale[i] = prior.sigma[free[i]];
    for (Eigen::Index j = 0; j < n; ++j) {
      cov(i, j) = batch.cov(free[i], free[j]) / (prior.sigma[free[i]] * prior.sigma[free[j]]);
    }
  }
  const Identifiability seen = AnalyseIdentifiability(names, units, scale, cov);
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool thin = names[i].starts_with("I_") && ThinnestShare(batch.mean) < kNotABody;
    parameters->push_back({names[i], batch.mean[free[i]], std::sqrt(batch.cov(free[i], free[i])),
                           units[i], thin ? "at_bound" : seen.status[i]});
  }
  *unobservable = seen.combinations;
}

RotorAeroModel ModelFor(const RotorCalibrationOptions& options, const FlightLog& log) {
  return RotorAeroModel(options.vehicle.model.rotors(), log.gravity,
                        RotorEffectsOn(log, options.effects));
}

std::vector<Effect> EffectsBesideConstants(const std::vector<Effect>& effects,
                                           const RotorPrior& prior) {
  std::vector<Effect> beside;
  for (Effect effect : effects) {
    const bool of_constants = !RotorExtensionOf({effect}).added.isZero(0.0);
    bool stated = of_constants;
    for (const EffectParameterInfo& info : InfoOf(effect).parameters) {
      if (!of_constants || !prior.Estimates(info.constant)) {
        stated = stated && effect[info.name] == info.neutral;
        continue;
      }
      effect.values[info.name] = info.neutral;
    }
    if (!stated) beside.push_back(effect);
  }
  return beside;
}

namespace {

// The status by what the flight shows. Beside a model as sharp as the flight, no constant's sigma
// is much smaller than the prior's.
void StateWhatIsShown(const RotorPrior& without_model, RotorCalibration* result) {
  std::vector<ParameterEstimate> alone;
  result->unobservable.clear();
  DescribeConstants(*result->alone, without_model, &alone, &result->unobservable);
  for (ParameterEstimate& p : result->parameters) {
    const auto shown = std::ranges::find(alone, p.name, &ParameterEstimate::name);
    if (shown != alone.end() && p.status != "at_bound") p.status = shown->status;
  }
}

// CalibrateRotors, with the options as they are.
RotorCalibration CalibrateWith(const FlightLog& log, const RotorCalibrationOptions& options) {
  const RotorAeroModel model = ModelFor(options, log);
  const int rotors = model.num_rotors();
  RotorCalibration result;
  result.warnings = log.warnings;
  result.warnings.insert(result.warnings.end(), options.warnings.begin(), options.warnings.end());
  const double whole = Duration(MakeRotorData(log, rotors, options.data));
  const double fitted = (1.0 - options.hold_out) * whole;
  const double shortest =
      std::min(0.5 * fitted, options.hold_out > 0.0 ? options.hold_out * whole : INFINITY);
  if (shortest < kShortestPart) {
    throw ErrorAt(log.directory, 0,
                  fmt::format("is too short: of {:.1f} s each half of the fitted part and the "
                              "held-out part need {} s; fly longer or set hold_out: 0",
                              whole, kShortestPart));
  }
  RotorDataOptions streams = options.data;
  RotorEkfOptions filter{options.noise, options.prior, options.wander};
  LearnFromFlight(model, log,
                  {options.learn_noise, options.learn_rotor_delay, options.learn_gyro_delay,
                   std::min(fitted, RotorLearning().seconds), options.noise},
                  &streams, &filter);
  if (options.data.motors) RelineariseMotors(model, log, options, fitted, &streams, &filter);
  const RotorData data = MakeRotorData(log, rotors, Part(streams, 0.0, fitted));
  result.speed_sigma = data.measured.model.sigma;
  result.rotor_delay = streams.rotor_delay;
  result.gyro_delay = streams.gyro_delay;
  result.noise = filter.noise;
  result.filter = RunRotorEkf(model, data, filter);
  const FittedPart part{log, model, streams, data, filter.noise, fitted};
  EstimateConstants(part, options, nullptr, &result);
  if (options.prior_without_model) result.alone = FitAlone(part, options, result.batch);
  const auto nodes = static_cast<double>(result.batch.nodes.size());
  const auto constants = static_cast<double>(options.prior.Free().size());
  result.chi_square =
      2.0 * result.batch.cost / (result.batch.residuals - kNodeErrors * nodes - constants);
  result.origin = data.origin;
  for (const RotorPose& pose : data.poses) result.pose_times.push_back(pose.t);
  DescribeConstants(result.batch, options.prior, &result.parameters, &result.unobservable);
  if (result.alone) StateWhatIsShown(*options.prior_without_model, &result);
  result.effects = EffectsBesideConstants(options.effects, options.prior);
  if (options.hold_out > 0.0) {
    ScorePredictions(model, data, MakeRotorData(log, rotors, Part(streams, fitted, 0.0)), options,
                     &result);
  }
  if (!result.biases_differ.empty()) {
    result.warnings.push_back(fmt::format(
        "the halves of the flight show different biases (by this many of their sigmas): {}; they "
        "drift, or forces come and go; their intervals are widened until the halves agree within "
        "two",
        fmt::join(result.biases_differ, ", ")));
  }
  result.verdict = JudgeRotors(result);
  return result;
}

RotorCalibrationOptions WithoutEffects(RotorCalibrationOptions options) {
  options.prior.mean -= options.of_effects;
  options.prior_without_model->mean -= options.of_effects;
  options.of_effects.setZero();
  options.data.motor_lag -= RotorExtensionOf(options.effects).motor_lag;
  options.effects.clear();
  return options;
}

}  // namespace

RotorCalibration CalibrateRotors(const FlightLog& log, const RotorCalibrationOptions& options,
                                 RotorCalibrationOptions* used) {
  const CalibrationWithModel<RotorCalibrationOptions, RotorCalibration> calibration{
      .fit = [&](const auto& o) { return CalibrateWith(log, o); },
      .contradicts = [](const auto& o, const auto& fit) -> std::optional<bool> {
        if (!fit.alone) return std::nullopt;
        return Contradicts(o.prior, *o.prior_without_model, *fit.alone);
      },
      .without_effects = [](const auto& o) { return WithoutEffects(o); },
      .without_constants = [](const auto& o) { return WithoutConstants(o); },
      .compare =
          [&](const auto& open, const auto& fit) {
            return CompareWithModel(options.prior, open.prior, fit.batch);
          }};
  RotorCalibrationOptions own = options;
  RotorCalibration result = calibration.Run(&own);
  if (used != nullptr) *used = std::move(own);
  return result;
}

std::vector<StreamDelay> DelaysOf(const RotorCalibration& calibration) {
  const ParameterEstimate* delay = Named("pose_delay", calibration);
  if (delay == nullptr) return {};
  return {{"pose", delay->value, delay->sigma}, {"mocap", delay->value, delay->sigma}};
}

}  // namespace trueline
