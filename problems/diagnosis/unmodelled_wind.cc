#include "problems/diagnosis/unmodelled_wind.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "problems/calibration/conflict.h"
#include "problems/common/error.h"
#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/score_test.h"
#include "problems/diagnosis/thresholds.h"

namespace trueline {
namespace {

void SetEffects(const std::vector<Effect>& effects, CalibrationOptions* options) {
  options->effects = effects;
  options->methods.vgd.drive.force_effects = ForceEffectsOf(effects);
}

// Options that give the reported run alone, with the priors and effects that it had in the end.
CalibrationOptions OptionsOfReported(const Calibration& calibration, CalibrationOptions options) {
  options.estimators = {calibration.Reported().estimator};
  options.gamma_sweep.clear();
  options.methods.vgd.priors = calibration.priors;
  options.priors_without_model.reset();
  options.warnings.clear();
  SetEffects(calibration.effects, &options);
  return options;
}

// The last minutes before `end` of a long flight; all of another.
FlightLog PartBefore(TimeNs end, FlightLog log) {
  constexpr double kLong = 600.0, kPart = 240.0;  // s
  if (SecondsBetween(log.imu.front().t, log.imu.back().t) <= kLong) return log;
  const TimeNs from = end - FromSeconds(kPart);
  ForEachStream(log, [&](const Stream&, auto& samples) {
    std::erase_if(samples, [&](const auto& sample) { return sample.t < from; });
  });
  return log;
}

// A wind in the base fit, whose constants are stated without and with it.
struct WindFit {
  Found found;
  ScoreTest test;
  std::vector<ParameterEstimate> without, with;
};

// The wind by one linear step; none if its score is not significant.
std::optional<Found> StepToWind(const ImuDrivenFlight& flight) {
  const Candidate wind{&InfoOf("wind"), {}};
  const auto fit = flight.Linearise({wind}, false);
  const EffectColumns& own = fit->candidates.front();
  const ScoreTest test =
      TestColumns(*fit, fit->Modelled(), own.columns, own.Steps(*wind.info, wind.Ordinary()));
  if (test.p() >= SearchOptions().alpha) return std::nullopt;
  return Found{wind, wind.Neutral() + own.Sizes(*wind.info, test.value)};
}

// Certain, and as large as the flight shows with 95 % power.
bool IsShown(const ImuDrivenFlight& flight, const Found& found, const ScoreTest& test) {
  constexpr double kCertain = 1e-6;
  const Eigen::VectorXd detectable = DetectableSize(test, kCertain);
  return test.p() < kCertain && found.value.cwiseQuotient(detectable).norm() >= 1.0 &&
         Plausible(found.candidate, found.value) && flight.ConstantsArePhysical(found);
}

std::optional<WindFit> FitWind(const FlightLog& log, const CalibrationOptions& options) try {
  ImuDrivenFlight flight(PrepareLog(log, DiagnosisOptionsOf(options)));
  const std::optional<Found> step = StepToWind(flight);
  if (!step || !Plausible(step->candidate, step->value)) return std::nullopt;
  const std::vector<ParameterEstimate> without = flight.Estimates();
  std::vector<Found> found{*step};
  flight.Fit(&found);
  const ScoreTest test = TestFound(*flight.Linearise({}, false), found, 0);
  if (!IsShown(flight, found.front(), test)) return std::nullopt;
  return WindFit{found.front(), test, without, flight.Estimates()};
} catch (const InputError&) {
  return std::nullopt;  // the base fit can't be made
}

std::vector<MovedConstant> MovesOf(const Estimates& stated, const Estimates& without,
                                   const Estimates& with) {
  std::vector<MovedConstant> moves;
  for (const ParameterEstimate& p : stated) {
    const auto from = std::ranges::find(without, p.name, &ParameterEstimate::name);
    const auto to = std::ranges::find(with, p.name, &ParameterEstimate::name);
    if (from == without.end() || to == with.end()) continue;
    const double move = to->value - from->value;
    moves.push_back({p.name, p.unit, p.value, p.value + move, std::abs(move) / p.sigma});
  }
  std::ranges::sort(moves, std::greater<>(), &MovedConstant::sigmas);
  return moves;
}

// What a calibration states of its first flight: by the whole flight if that was solved, else by
// the last window.
const Estimates& StatedBy(const Calibration& calibration, bool whole_flight) {
  return whole_flight ? calibration.whole_flight->parameters
                      : calibration.Reported().windows.back().parameters;
}

std::vector<MovedConstant> MovesWith(const WindFit& wind, const FlightLog& log,
                                     CalibrationOptions options, const Calibration& calibration) {
  const EstimatorEntry& estimator = FindEstimator(calibration.Reported().estimator);
  const bool whole_flight =
      estimator.whole_flight && calibration.whole_flight && calibration.whole_flight->flights == 1;
  const Estimates& stated = StatedBy(calibration, whole_flight);
  if (!estimator.force_effects) return MovesOf(stated, wind.without, wind.with);
  std::vector<Effect> effects = options.effects;
  effects.push_back(wind.found.effect());
  SetEffects(effects, &options);
  return MovesOf(stated, stated, StatedBy(Calibrate(log, options), whole_flight));
}

// "with it b_ay would be -0.04 instead of -0.68 m/s^2 (9 of its sigmas)", or that none moves so
// far.
std::string MovesInWords(const std::vector<MovedConstant>& moved) {
  constexpr std::size_t kNamed = 3;  // at most
  std::vector<std::string> words;
  for (const MovedConstant& m : moved) {
    if (m.sigmas <= kChanceSigmas || words.size() == kNamed) break;
    words.push_back(fmt::format("{} would be {:.3f} instead of {:.3f} {} ({:.1f} of its sigmas)",
                                m.name, m.with, m.without, m.unit, m.sigmas));
  }
  if (!words.empty()) return fmt::format("with it {}", fmt::join(words, ", "));
  return fmt::format("no constant would move by more than {:g} of its sigmas with it",
                     kChanceSigmas);
}

}  // namespace

std::optional<UnmodelledWind> FindUnmodelledWind(const FlightLog& log,
                                                 const CalibrationOptions& options,
                                                 const Calibration& calibration) {
  const std::vector<WindowEstimate>& windows = calibration.Reported().windows;
  const bool has_wind = std::ranges::count(calibration.effects, "wind", &Effect::id) > 0;
  if (windows.empty() || has_wind || !LooksForWind(log, options.methods.vgd)) return std::nullopt;
  const CalibrationOptions reported = OptionsOfReported(calibration, options);
  const auto wind = FitWind(PartBefore(windows.back().end, log), reported);
  if (!wind) return std::nullopt;
  return UnmodelledWind{wind->found.value, wind->test.sigma, wind->test.p(),
                        MovesWith(*wind, log, reported, calibration)};
}

void JudgeWind(const FlightLog& log, const CalibrationOptions& options, Calibration* calibration) {
  if (calibration->verdict.word == "unusable") return;
  const auto wind = FindUnmodelledWind(log, options, *calibration);
  if (!wind) return;
  const bool taken = FindEstimator(calibration->Reported().estimator).force_effects;
  const std::string text = fmt::format(
      "the flight shows a wind of ({:.2f} +- {:.2f}, {:.2f} +- {:.2f}) m/s that this calibration "
      "leaves out: {}; trueline diagnose fits it, and calibrate --model=RESULT/model.yaml takes "
      "it{}",
      wind->value.x(), wind->sigma.x(), wind->value.y(), wind->sigma.y(), MovesInWords(wind->moved),
      taken ? "" : " with --estimator=vgd or smoother");
  const bool harmful = !wind->moved.empty() && wind->moved.front().sigmas > kChanceSigmas;
  if (harmful) {
    AddReasons({text}, &calibration->verdict);
  } else {
    calibration->warnings.push_back(text);
  }
}

}  // namespace trueline
