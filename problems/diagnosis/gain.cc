#include "problems/diagnosis/gain.h"

#include <algorithm>
#include <cmath>

#include "problems/common/parallel.h"
#include "problems/common/random.h"
#include "problems/diagnosis/cause_rounds.h"
#include "problems/diagnosis/misfit.h"
#include "problems/result/statistics.h"
#include "problems/vgd/vgd.h"

namespace trueline {
namespace {

constexpr int kRun = 3;  // arcs that share a window; clusters in a block of one half

int HalfOf(int cluster) { return (cluster / kRun) % 2; }

// The window's prior has the other half's estimates as means. Its sigmas add a share of the usual
// spread between vehicles: gusts bias drag and accelerometer biases by more than their stated
// sigmas.
VgdOptions OptionsFor(const VgdOptions& options, const PartFit& fit) {
  constexpr double kOfPrior = 0.3;
  VgdOptions vgd = options;
  vgd.adapt_drift = false;  // the same drift for all models
  for (std::size_t i = 0; i < vgd.priors.size(); ++i) {
    ParameterPrior& prior = vgd.priors[i];
    prior.mean = std::clamp(fit.value[static_cast<int>(i)], prior.lower, prior.upper);
    prior.sigma = std::hypot(kOfPrior * prior.sigma, fit.sigma[static_cast<int>(i)]);
  }
  vgd.drive.force_effects = ForceEffectsOf(fit.effects);
  return vgd;
}

// Predicts the arcs of one half with the other half's estimates.
void AddArcs(const FlightLog& corrected, const PartFit& fit, int half, const FlightPlan& plan,
             const VgdOptions& options, std::map<int, double>* errors) {
  const VgdOptions vgd = OptionsFor(options, fit);
  const FlightData flight(corrected, vgd.drive, vgd.passes, vgd.drag_measurement);
  for (int tau = 1; tau <= static_cast<int>(flight.passes.size()); ++tau) {
    const Pass& pass = flight.passes[tau - 1];
    const int cluster = plan.ClusterAt((pass.begin + pass.end) / 2);
    if (!flight.HasArc(tau) || HalfOf(cluster) != half) continue;
    const WindowEstimate window = SolveWindow(flight, vgd, tau, PriorMeans(vgd));
    if (window.arc && window.arc->truth) (*errors)[cluster] = window.arc->FinalPointError();
  }
}

double MeanOfRuns(const std::vector<double>& values, Random* random) {
  const int count = static_cast<int>(values.size());
  double sum = 0.0;
  int drawn = 0;
  while (drawn < count) {
    const int first = random->UniformInt(0, count - 1);
    for (int k = 0; k < kRun && drawn < count; ++k, ++drawn) sum += values[(first + k) % count];
  }
  return sum / count;
}

}  // namespace

HalfFits FitHalves(const FlightLog& log, const CauseSearch& search,
                   const std::vector<Found>& found) {
  HalfFits fits{log, search.path(), {}};
  for (const int half : {0, 1}) {
    std::vector<bool> used(search.plan().clusters);
    for (int c = 0; c < search.plan().clusters; ++c) used[c] = HalfOf(c) != half;
    fits.by_half[half] = search.FitOf(found, used);
  }
  return fits;
}

HeldOutErrors ErrorsOf(const HalfFits& fits, const CauseSearch& search, const VgdOptions& options) {
  std::array<HeldOutErrors, 2> errors;
  ParallelFor(2, 0, [&](int half) {
    const PartFit& fit = fits.by_half[half];
    const FlightLog corrected = CorrectLog(fits.log, fit.effects, fits.path);
    if (!corrected.fixes.empty()) {
      AddArcs(corrected, fit, half, search.plan(), options, &errors[half].arcs);
    }
    if (fits.log.mocap.empty()) return;
    std::vector<int> segments;
    for (int s = 0; s < static_cast<int>(search.plan().segments.size()); s += 2) {
      if (HalfOf(search.plan().segments[s].cluster) == half) segments.push_back(s);
    }
    for (const ReplayError& r :
         ReplayPart(search, fits.log, corrected, options.drive, fit, segments)) {
      errors[half].replays[r.segment] = r.error_E.norm();
    }
  });
  errors[0].arcs.merge(errors[1].arcs);
  errors[0].replays.merge(errors[1].replays);
  return errors[0];
}

Gain GainBetween(const std::map<int, double>& before, const std::map<int, double>& after) {
  constexpr int kDraws = 2000;
  std::vector<double> differences, errors_before, errors_after;
  for (const auto& [cluster, error] : after) {
    const auto other = before.find(cluster);
    if (other == before.end()) continue;
    errors_before.push_back(other->second);
    errors_after.push_back(error);
    differences.push_back(other->second - error);
  }
  Gain gain;
  gain.arcs = static_cast<int>(differences.size());
  if (gain.arcs == 0) return gain;
  gain.before = Mean(errors_before);
  gain.after = Mean(errors_after);
  Random random(1, "gain");
  std::vector<double> means(kDraws);
  for (double& mean : means) mean = MeanOfRuns(differences, &random);
  gain.low = Quantile(means, 0.025);
  gain.high = Quantile(means, 0.975);
  return gain;
}

bool Harmful(const Cause& cause) {
  // A small loss is no evidence against a cause: laps repeat, so an unmodelled effect may favour
  // the worse model slightly on both halves, and positions do not show every sensor error.
  constexpr double kBeyondDoubt = 1e-12;  // p-value of a cause that is certain
  const double limit = cause.p < kBeyondDoubt ? 1.25 : 1.1;
  const Gain &arcs = cause.gain, &replays = cause.open_loop;
  const auto ratio = [](const Gain& g) { return g.arcs > 0 ? g.after / g.before : 1.0; };
  const auto worse = [](const Gain& g) { return g.arcs > 0 && g.high < 0.0; };
  const auto better = [](const Gain& g) { return g.arcs > 0 && g.low > 0.0; };
  const bool clear = worse(arcs) || worse(replays) || !(better(arcs) || better(replays));
  return clear && ratio(arcs) * ratio(replays) > limit;
}

namespace {

void SetGains(const HeldOutErrors& before, const HeldOutErrors& after, Gain* arcs, Gain* replays) {
  *arcs = GainBetween(before.arcs, after.arcs);
  *replays = GainBetween(before.replays, after.replays);
}

// Errors of the model without one cause, the others refitted.
HeldOutErrors ErrorsWithout(std::size_t cause, const FlightLog& log, std::vector<Found> found,
                            const VgdOptions& vgd, CauseSearch* spare) {
  found.erase(found.begin() + static_cast<long>(cause));
  Refit(spare, &found);
  return ErrorsOf(FitHalves(log, *spare, found), *spare, vgd);
}

}  // namespace

void MeasureGains(const GainLogs& logs, const DiagnosisOptions& options,
                  const std::vector<Found>& found, const CauseSearch& search,
                  const HeldOutErrors& bare, CauseSearch* spare, Diagnosis* diagnosis) {
  std::vector<Cause>& causes = diagnosis->causes;
  const std::size_t searched_from = causes.size() - found.size();  // a false gate comes first in
                                                                   // `causes`
  const HeldOutErrors all = ErrorsOf(FitHalves(logs.kept, search, found), search, options.vgd);
  SetGains(bare, all, &diagnosis->gain, &diagnosis->open_loop);
  for (std::size_t i = 0; i < causes.size(); ++i) {
    HeldOutErrors before = bare;
    if (causes.size() > 1 && i < searched_from) {
      before = ErrorsOf(FitHalves(logs.recorded, search, found), search, options.vgd);
    } else if (causes.size() > 1) {
      before = ErrorsWithout(i - searched_from, logs.kept, found, options.vgd, spare);
    }
    SetGains(before, all, &causes[i].gain, &causes[i].open_loop);
  }
}

}  // namespace trueline
